-- Where the pictures should show the arcs of the model: points along them.
-- Takes run_id; gives one row a point, arc by arc, in order along each; px.
SELECT v.camera, p.view_arc_no, CAST(p.x AS DOUBLE PRECISION) AS x, CAST(p.y AS DOUBLE PRECISION) AS y
FROM view_point AS p
JOIN inspection_image AS v ON v.run_id = p.run_id AND v.view_no = p.view_no
WHERE p.run_id = :run_id
ORDER BY v.camera, p.view_arc_no, p.point_no
