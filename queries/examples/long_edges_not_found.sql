-- Which edges of the model of more than 100 px did the newest inspection predict and not find, and why?
SELECT d.camera, d.path, d.view_arc_no, d.length, d.rule
FROM why_view_arc AS d
WHERE d.run_id = (SELECT max(pose.run_id) FROM pose) AND d.kind = 'sharp' AND d.length > 100 /* length */
    AND d.rule <> 'found'
ORDER BY d.length DESC, d.camera, d.view_arc_no
