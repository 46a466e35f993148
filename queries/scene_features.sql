-- Features of shapes with the surfaces that make them.
-- takes: shape_ids (array)
-- gives: one row a feature and surface, in order of shape, feature and surface
SELECT f.shape_id, f.feature_no, f.name, s.surface_no
FROM feature AS f
JOIN feature_surface AS s ON s.shape_id = f.shape_id AND s.feature_no = f.feature_no
WHERE f.shape_id = ANY(:shape_ids)
ORDER BY f.shape_id, f.feature_no, s.surface_no
