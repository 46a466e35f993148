-- Features of a shape, to be compared.
-- Takes shape_id; gives feature_no, class_id, kind, shape_from_feature m00 .. m23 and box x0 .. z1, in order.
SELECT f.feature_no, f.feature_class_id AS class_id, k.kind,
    f.m00, f.m01, f.m02, f.m03,
    f.m10, f.m11, f.m12, f.m13,
    f.m20, f.m21, f.m22, f.m23,
    f.x0, f.y0, f.z0, f.x1, f.y1, f.z1
FROM feature AS f
JOIN feature_class AS k ON k.id = f.feature_class_id
WHERE f.shape_id = :shape_id
ORDER BY f.feature_no
