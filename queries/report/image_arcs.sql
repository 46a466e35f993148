-- The arcs of a picture, and where they run.
-- Takes extraction_id; gives one row an arc, in order; length and ends in px, x and y of the edge elements along it (arrays).
SELECT a.image_arc_no, a.kind, a.topography, a.length, a.closed, a.start_x, a.start_y, a.end_x, a.end_y, e.x, e.y
FROM image_arc AS a
LEFT JOIN (
    SELECT image_arc_no, array_agg(CAST(x AS DOUBLE PRECISION) ORDER BY edge_element_no) AS x,
        array_agg(CAST(y AS DOUBLE PRECISION) ORDER BY edge_element_no) AS y
    FROM edge_element
    WHERE extraction_id = :extraction_id
    GROUP BY image_arc_no
) AS e ON e.image_arc_no = a.image_arc_no
WHERE a.extraction_id = :extraction_id
ORDER BY a.image_arc_no
