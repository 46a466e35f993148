-- Which holes of 8 to 9 mm have their axis within 150 mm of that of a lug?
WITH body AS (
    SELECT shape_id
    FROM placed_part
    WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
),
hole AS (
    SELECT f.shape_id, f.name, d.value AS diameter, f.m03 AS x, f.m13 AS y
    FROM body
    JOIN feature AS f ON f.shape_id = body.shape_id
    JOIN feature_class AS k ON k.id = f.feature_class_id AND k.kind IN ('through_hole', 'blind_hole')
    JOIN feature_dimension AS d ON d.feature_class_id = k.id AND d.name = 'diameter' AND d.value BETWEEN 8 /* least */ AND 9 /* greatest */
),
near AS (  -- the frame of a lug stands on the axis of its bore
    SELECT hole.name AS hole, hole.diameter, hole.x, hole.y, f.name AS lug,
        sqrt(power(hole.x - f.m03, 2) + power(hole.y - f.m13, 2)) AS distance
    FROM hole
    JOIN feature AS f ON f.shape_id = hole.shape_id
    JOIN feature_class AS k ON k.id = f.feature_class_id AND k.kind = 'lug'
)
SELECT hole, diameter, x, y, lug, distance
FROM near
WHERE distance <= 150 /* distance */
ORDER BY distance, hole
