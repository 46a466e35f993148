-- The model arcs that the cameras should see at the best pose, by part, and where the pictures should show them.
-- Takes run_id; gives one row an arc: camera, number in the view, path of its part, kind, what became of it, in words too, and
-- x and y of the points along it (arrays), px.
SELECT w.camera, w.view_arc_no, w.path, w.kind, w.rule, w.sentence, p.x, p.y
FROM why_view_arc AS w
JOIN inspection_image AS v ON v.run_id = w.run_id AND v.camera = w.camera
JOIN (
    SELECT view_no, view_arc_no, array_agg(CAST(x AS DOUBLE PRECISION) ORDER BY point_no) AS x,
        array_agg(CAST(y AS DOUBLE PRECISION) ORDER BY point_no) AS y
    FROM view_point
    WHERE run_id = :run_id
    GROUP BY view_no, view_arc_no
) AS p ON p.view_no = v.view_no AND p.view_arc_no = w.view_arc_no
WHERE w.run_id = :run_id
ORDER BY w.camera, w.view_arc_no
