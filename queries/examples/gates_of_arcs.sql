-- Which gate did each image arc of the newest inspection have to pass, and did it?
SELECT w.camera, w.image_arc_no, w.path, w.element, w.rule, w.value, w.gate, w.taken
FROM why_arc AS w
WHERE w.run_id = (SELECT max(pose.run_id) FROM pose) AND w.view_arc_no IS NOT NULL
ORDER BY w.camera, w.image_arc_no, w.view_arc_no
