-- Features of shapes with their dimensions, one row a dimension.
-- Takes shape_ids (array); gives shape_id, feature_no, name, kind, dimension, value, unit and the box x0 .. z1 in the
-- shape's frame, sorted.
SELECT f.shape_id, f.feature_no, f.name, k.kind, d.name AS dimension, d.value, d.unit, f.x0, f.y0, f.z0, f.x1, f.y1, f.z1
FROM feature AS f
JOIN feature_class AS k ON k.id = f.feature_class_id
LEFT JOIN feature_dimension AS d ON d.feature_class_id = k.id
WHERE f.shape_id = ANY(:shape_ids)
ORDER BY f.shape_id, f.feature_no, d.name
