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
SELECT DISTINCT CASE WHEN r.surface_a = o.surface_no THEN r.surface_b ELSE r.surface_a END AS surface_no
FROM of_datum AS o
JOIN surface_relation AS r
    ON r.shape_id = o.shape_id AND r.kind = 'coaxial' AND (r.surface_a = o.surface_no OR r.surface_b = o.surface_no)
ORDER BY surface_no
