-- Features of shapes with their surfaces.
-- Takes shape_ids (array); gives one row a feature, in order of shape and feature.
SELECT f.shape_id, f.feature_no, f.name, k.kind, array_agg(s.surface_no ORDER BY s.surface_no) AS surfaces
FROM feature AS f
JOIN feature_class AS k ON k.id = f.feature_class_id
JOIN feature_surface AS s ON s.shape_id = f.shape_id AND s.feature_no = f.feature_no
WHERE f.shape_id = ANY(:shape_ids)
GROUP BY f.shape_id, f.feature_no, f.name, k.kind
ORDER BY f.shape_id, f.feature_no
