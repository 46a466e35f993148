-- The model arcs that the cameras should see at the best pose, by part.
-- Takes run_id; gives one row an arc: camera, number in the view, path of its part, kind, arc or surface of the shape.
SELECT v.camera, a.view_arc_no, o.path, a.kind, a.arc_no, a.surface_no, a.length
FROM view_arc AS a
JOIN inspection_image AS v ON v.run_id = a.run_id AND v.view_no = a.view_no
JOIN placed_node AS o ON o.id = a.occurrence_id
WHERE a.run_id = :run_id
ORDER BY v.camera, a.view_arc_no
