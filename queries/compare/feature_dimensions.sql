-- Dimensions of the classes of the features of a shape.
-- Takes shape_id; gives class_id, name, value and unit, sorted.
SELECT DISTINCT f.feature_class_id AS class_id, d.name, d.value, d.unit
FROM feature AS f
JOIN feature_dimension AS d ON d.feature_class_id = f.feature_class_id
WHERE f.shape_id = :shape_id
ORDER BY class_id, d.name
