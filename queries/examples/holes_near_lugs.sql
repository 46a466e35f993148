-- Which holes of 8 to 9 mm have their axis within 150 mm of a lug's bore?
WITH body AS (
    SELECT p.shape_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id
    JOIN part AS p ON p.id = i.part_id
    WHERE v.name = 'bulkhead' AND v.variant = 'A' AND i.name = 'BODY'
),
hole AS (
    SELECT f.feature_no, f.name, d.value AS diameter, f.m03 AS x, f.m13 AS y
    FROM body
    JOIN feature AS f ON f.shape_id = body.shape_id
    JOIN feature_class AS k ON k.id = f.feature_class_id AND k.kind IN ('through_hole', 'blind_hole')
    JOIN feature_dimension AS d ON d.feature_class_id = k.id AND d.name = 'diameter'
)
SELECT hole.name AS hole, hole.diameter, hole.x, hole.y, min(sqrt((hole.x - bore.x) * (hole.x - bore.x) + (hole.y - bore.y) * (hole.y - bore.y))) AS distance
FROM hole
JOIN hole AS bore ON abs(bore.diameter - 42) < 0.01
WHERE hole.diameter BETWEEN 8 AND 9
GROUP BY hole.name, hole.diameter, hole.x, hole.y
HAVING min(sqrt((hole.x - bore.x) * (hole.x - bore.x) + (hole.y - bore.y) * (hole.y - bore.y))) <= 150
ORDER BY distance
