-- Which model arcs of a view belong to each part and feature in view.
-- Takes run_id; gives in_view_no, camera and view_arc_no, in order.
SELECT DISTINCT p.in_view_no, v.camera, a.view_arc_no
FROM part_in_view AS p
JOIN placed_node AS o ON o.id = p.occurrence_id
JOIN view_arc AS a ON a.run_id = p.run_id AND a.occurrence_id = p.occurrence_id
JOIN inspection_image AS v ON v.run_id = a.run_id AND v.view_no = a.view_no
LEFT JOIN shape_arc AS h ON h.shape_id = o.shape_id AND h.arc_no = a.arc_no
LEFT JOIN feature_surface AS f ON f.shape_id = o.shape_id AND f.feature_no = p.feature_no
    AND (f.surface_no = h.surface_a OR f.surface_no = h.surface_b OR f.surface_no = a.surface_no)
WHERE p.run_id = :run_id AND (p.level = 'part' OR f.surface_no IS NOT NULL)
ORDER BY p.in_view_no, v.camera, a.view_arc_no
