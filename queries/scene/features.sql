-- Features of shapes with the surfaces that make them, and the thickness of ribs and webs.
-- Takes shape_ids (array); gives one row a feature and surface, in order of shape, feature and surface; thickness in
-- mm, NULL where it has none.
SELECT f.shape_id, f.feature_no, f.name, k.kind, s.surface_no, d.value AS thickness
FROM feature AS f
JOIN feature_class AS k ON k.id = f.feature_class_id
JOIN feature_surface AS s ON s.shape_id = f.shape_id AND s.feature_no = f.feature_no
LEFT JOIN feature_dimension AS d ON d.feature_class_id = k.id AND d.name = 'thickness' AND k.kind IN ('rib', 'web')
WHERE f.shape_id = ANY(:shape_ids)
ORDER BY f.shape_id, f.feature_no, s.surface_no
