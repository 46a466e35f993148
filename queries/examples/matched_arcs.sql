-- Which model arcs were matched in the newest inspection, with residuals in pixels?
SELECT m.camera, m.path, m.view_kind, m.arc_no, m.surface_no, m.image_arc_no, m.residual, m.overlap
FROM matched_arc AS m
WHERE m.run_id = (SELECT max(pose.run_id) FROM pose)
ORDER BY m.camera, m.residual DESC, m.image_arc_no
