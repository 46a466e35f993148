-- The courses of the free arcs of an extraction.
-- Takes extraction_id; gives image_arc_no, x, y, sigma.
SELECT image_arc_no,
    CAST(x AS DOUBLE PRECISION) AS x,
    CAST(y AS DOUBLE PRECISION) AS y,
    CAST(sigma AS DOUBLE PRECISION) AS sigma
FROM image_arc_point
WHERE extraction_id = :extraction_id
ORDER BY image_arc_no, point_no
