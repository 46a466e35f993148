-- The relations among the units of an extraction.
-- Takes extraction_id; gives kind, unit_a, unit_b, distance, distance_sigma, angle, angle_sigma.
SELECT r.kind, r.unit_a, r.unit_b,
    CAST(r.distance AS DOUBLE PRECISION) AS distance, CAST(r.distance_sigma AS DOUBLE PRECISION) AS distance_sigma,
    CAST(r.angle AS DOUBLE PRECISION) AS angle, CAST(r.angle_sigma AS DOUBLE PRECISION) AS angle_sigma
FROM unit_set AS s
JOIN unit_relation AS r ON r.unit_set_id = s.id
WHERE s.extraction_id = :extraction_id
ORDER BY r.kind, r.unit_a, r.unit_b
