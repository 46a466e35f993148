-- The standpoints of an inspection, and whether its pictures agree with where they are stated to be.
-- Takes run_id; gives one row a standpoint; moved in mm, as solved, and by how many standard deviations the pictures contradict it.
SELECT s.name AS standpoint, CASE WHEN s.ignored THEN 'left out' WHEN s.sigmas IS NULL THEN 'not solved'
        WHEN s.sigmas > t.value THEN 'contradicted' ELSE 'agrees' END AS state,
    sqrt(power(s.moved[1], 2) + power(s.moved[2], 2) + power(s.moved[3], 2)) AS moved_mm, s.sigmas
FROM standpoint AS s
LEFT JOIN (SELECT run_id, min(value) AS value FROM threshold  -- older runs have fewer limits
    WHERE decision = 'verdict' AND name IN ('named_standpoint_sigma', 'max_standpoint_sigma', 'max_calibration_sigma') GROUP BY run_id) AS t ON t.run_id = s.run_id
WHERE s.run_id = :run_id
ORDER BY s.standpoint_no
