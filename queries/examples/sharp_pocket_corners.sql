-- Which pockets have corners of less than 12 mm radius?
WITH body AS (
    SELECT p.shape_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id
    JOIN part AS p ON p.id = i.part_id
    WHERE v.name = 'bulkhead' /* object */ AND v.variant = 'A' /* variant */ AND i.name = 'BODY' /* part */
    ORDER BY v.revision DESC
    LIMIT 1
)
SELECT f.name AS pocket, d.value AS corner_radius, (f.x0 + f.x1) / 2 AS x, (f.y0 + f.y1) / 2 AS y
FROM body
JOIN feature AS f ON f.shape_id = body.shape_id
JOIN feature_class AS k ON k.id = f.feature_class_id AND k.kind = 'pocket'
JOIN feature_dimension AS d ON d.feature_class_id = k.id AND d.name = 'corner_radius'
WHERE d.value < 12 /* radius */ - 1e-6
ORDER BY d.value, f.feature_no
