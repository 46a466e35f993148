-- The relations of a set of units.
-- Takes unit_set_id; gives kind, unit_a, unit_b, distance, distance_sigma, angle, angle_sigma.
SELECT kind, unit_a, unit_b,
    CAST(distance AS DOUBLE PRECISION) AS distance, CAST(distance_sigma AS DOUBLE PRECISION) AS distance_sigma,
    CAST(angle AS DOUBLE PRECISION) AS angle, CAST(angle_sigma AS DOUBLE PRECISION) AS angle_sigma
FROM unit_relation
WHERE unit_set_id = :unit_set_id
ORDER BY kind, unit_a, unit_b
