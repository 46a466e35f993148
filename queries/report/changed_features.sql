-- The surfaces of the features that differ between two variants.
-- Takes comparison_id.  Gives status, shape_id, surface_no and whether the shape is of the variant after (1) or of the one
-- before (0: of what is gone), in order.
SELECT d.status, CASE WHEN d.status = 'removed' THEN 0 ELSE 1 END AS after, f.shape_id, f.surface_no
FROM variant_difference AS d
JOIN feature_surface AS f ON (d.status = 'removed' AND f.shape_id = d.shape_a AND f.feature_no = d.element_a)
    OR (d.status <> 'removed' AND f.shape_id = d.shape_b AND f.feature_no = d.element_b)
WHERE d.comparison_id = :comparison_id AND d.level = 'feature' AND d.status <> 'identical'
ORDER BY f.shape_id, f.surface_no, d.difference_no
