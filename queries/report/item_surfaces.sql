-- The surfaces of the features in view.
-- Takes run_id; gives in_view_no and surface_no, in order.
SELECT p.in_view_no, f.surface_no
FROM part_in_view AS p
JOIN placed_node AS o ON o.id = p.occurrence_id
JOIN feature_surface AS f ON f.shape_id = o.shape_id AND f.feature_no = p.feature_no
WHERE p.run_id = :run_id
ORDER BY p.in_view_no, f.surface_no
