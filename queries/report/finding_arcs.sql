-- Which model arcs of a view show each finding.
-- Takes run_id; gives finding_no, camera and view_arc_no, in order.
SELECT DISTINCT f.finding_no, v.camera, a.view_arc_no
FROM finding AS f
JOIN placed_node AS o ON o.id = f.occurrence_id
JOIN view_arc AS a ON a.run_id = f.run_id AND a.occurrence_id = f.occurrence_id
JOIN inspection_image AS v ON v.run_id = a.run_id AND v.view_no = a.view_no
LEFT JOIN shape_arc AS h ON h.shape_id = o.shape_id AND h.arc_no = a.arc_no
LEFT JOIN feature_surface AS s ON s.shape_id = o.shape_id AND s.feature_no = f.feature_no
    AND (s.surface_no = h.surface_a OR s.surface_no = h.surface_b OR s.surface_no = a.surface_no)
WHERE f.run_id = :run_id AND (f.level = 'part' OR s.surface_no IS NOT NULL)
ORDER BY f.finding_no, v.camera, a.view_arc_no
