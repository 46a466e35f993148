-- The model arcs that the cameras should see at the best pose, by part, and where the pictures should show them.
-- Takes run_id; gives one row an arc: camera, number in the view, path of its part, kind, arc or surface of the shape, length,
-- and x and y of the points along it (arrays), px.
SELECT v.camera, a.view_arc_no, o.path, a.kind, a.arc_no, a.surface_no, a.length, p.x, p.y
FROM view_arc AS a
JOIN inspection_image AS v ON v.run_id = a.run_id AND v.view_no = a.view_no
JOIN placed_node AS o ON o.id = a.occurrence_id
JOIN (
    SELECT view_no, view_arc_no, array_agg(CAST(x AS DOUBLE PRECISION) ORDER BY point_no) AS x,
        array_agg(CAST(y AS DOUBLE PRECISION) ORDER BY point_no) AS y
    FROM view_point
    WHERE run_id = :run_id
    GROUP BY view_no, view_arc_no
) AS p ON p.view_no = a.view_no AND p.view_arc_no = a.view_arc_no
WHERE a.run_id = :run_id
ORDER BY v.camera, a.view_arc_no
