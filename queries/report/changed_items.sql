-- What differs between two variants, with the surfaces that it has.
-- Takes comparison_id; gives one row a part, feature or surface that is not identical: level, status, kind, name, path,
-- after (1: shape and surfaces are of the variant after, 0: of the one before, of what is gone), shape_id, surfaces
-- (null: all of the part); parts, then features, then surfaces.
SELECT d.difference_no, d.level, d.status, coalesce(v.kind, '') AS kind, coalesce(v.name_b, v.name_a, '') AS name,
    coalesce(d.object_path_b, d.object_path_a) AS path, CASE WHEN d.status = 'removed' THEN 0 ELSE 1 END AS after,
    CASE WHEN d.status = 'removed' THEN d.shape_a ELSE d.shape_b END AS shape_id,
    CASE WHEN d.level <> 'part' THEN array_agg(coalesce(f.surface_no, d.element_b, d.element_a) ORDER BY f.surface_no)
        END AS surfaces,
    d.distance, d.angle, d.differs
FROM variant_difference AS d
LEFT JOIN (
    SELECT c.difference_no, k.kind, fa.name AS name_a, fb.name AS name_b
    FROM variant_difference AS c
    LEFT JOIN feature AS fa ON c.level = 'feature' AND fa.shape_id = c.shape_a AND fa.feature_no = c.element_a
    LEFT JOIN feature AS fb ON c.level = 'feature' AND fb.shape_id = c.shape_b AND fb.feature_no = c.element_b
    LEFT JOIN feature_class AS k ON k.id = coalesce(fb.feature_class_id, fa.feature_class_id)
    WHERE c.comparison_id = :comparison_id
) AS v ON v.difference_no = d.difference_no
LEFT JOIN feature_surface AS f ON d.level = 'feature'
    AND f.shape_id = CASE WHEN d.status = 'removed' THEN d.shape_a ELSE d.shape_b END
    AND f.feature_no = CASE WHEN d.status = 'removed' THEN d.element_a ELSE d.element_b END
WHERE d.comparison_id = :comparison_id AND d.status <> 'identical'
GROUP BY d.difference_no, d.level, d.status, v.kind, v.name_a, v.name_b, d.object_path_a, d.object_path_b, d.shape_a,
    d.shape_b, d.element_a, d.element_b, d.distance, d.angle, d.differs
ORDER BY d.difference_no
