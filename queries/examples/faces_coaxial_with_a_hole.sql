-- Which faces are coaxial with the hole nearest to x = -1170, y = 330?
WITH body AS (
    SELECT shape_id
    FROM placed_part
    WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
),
datum AS (
    SELECT f.shape_id, f.feature_no
    FROM body
    JOIN feature AS f ON f.shape_id = body.shape_id
    JOIN feature_class AS k ON k.id = f.feature_class_id AND k.kind = 'through_hole'
    ORDER BY power(f.m03 - -1170 /* x */, 2) + power(f.m13 - 330 /* y */, 2)
    LIMIT 1
),
of_datum AS (
    SELECT m.shape_id, m.surface_no
    FROM datum
    JOIN feature_surface AS m ON m.shape_id = datum.shape_id AND m.feature_no = datum.feature_no
)
-- Of round faces, those on the axis of the hole, parallel to 1e-4 rad and 1e-4 mm off at most.
SELECT DISTINCT s.surface_no
FROM of_datum AS o
JOIN shape_surface AS h ON h.shape_id = o.shape_id AND h.surface_no = o.surface_no
JOIN surface AS a ON a.id = h.surface_id AND a.recognised_kind IN ('cylinder', 'cone')
JOIN shape_surface AS s ON s.shape_id = o.shape_id AND s.surface_no <> o.surface_no
JOIN surface AS b ON b.id = s.surface_id AND b.recognised_kind IN ('cylinder', 'cone')
WHERE abs(a.axis_z_x * b.axis_z_x + a.axis_z_y * b.axis_z_y + a.axis_z_z * b.axis_z_z) > 1 - 5e-9
    AND power((b.origin_y - a.origin_y) * a.axis_z_z - (b.origin_z - a.origin_z) * a.axis_z_y, 2)
        + power((b.origin_z - a.origin_z) * a.axis_z_x - (b.origin_x - a.origin_x) * a.axis_z_z, 2)
        + power((b.origin_x - a.origin_x) * a.axis_z_y - (b.origin_y - a.origin_y) * a.axis_z_x, 2) <= 1e-8
ORDER BY surface_no
