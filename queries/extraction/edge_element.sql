-- The edge elements of an extraction; arc -1 where they are of none.
-- Takes extraction_id; gives x, y, normal_x, normal_y, contrast, width, sigma, image_arc_no.
SELECT CAST(x AS DOUBLE PRECISION) AS x,
    CAST(y AS DOUBLE PRECISION) AS y,
    CAST(normal_x AS DOUBLE PRECISION) AS normal_x,
    CAST(normal_y AS DOUBLE PRECISION) AS normal_y,
    CAST(contrast AS DOUBLE PRECISION) AS contrast,
    CAST(width AS DOUBLE PRECISION) AS width,
    CAST(sigma AS DOUBLE PRECISION) AS sigma,
    coalesce(image_arc_no, -1) AS image_arc_no
FROM edge_element
WHERE extraction_id = :extraction_id
ORDER BY edge_element_no
