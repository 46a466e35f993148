-- How many holes are there of each diameter?
WITH body AS (
    SELECT p.shape_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id
    JOIN part AS p ON p.id = i.part_id
    WHERE v.name = 'bulkhead' /* object */ AND v.variant = 'A' /* variant */ AND i.name = 'BODY' /* part */
    ORDER BY v.revision DESC
    LIMIT 1
)
SELECT round(CAST(d.value AS NUMERIC), 3) AS diameter, count(*) AS holes
FROM body
JOIN feature AS f ON f.shape_id = body.shape_id
JOIN feature_class AS k ON k.id = f.feature_class_id AND k.kind IN ('through_hole', 'blind_hole')
JOIN feature_dimension AS d ON d.feature_class_id = k.id AND d.name = 'diameter'
GROUP BY round(CAST(d.value AS NUMERIC), 3)
ORDER BY diameter
