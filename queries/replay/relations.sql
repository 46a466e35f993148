-- Relations of what stereo put in space, as the join was given them.
-- Takes run; gives unit_a, unit_b, distance, distance_sigma (mm) and alike, circles before lines.
SELECT unit_a, unit_b, distance, distance_sigma, alike
FROM space_relation
WHERE run_id = :run
ORDER BY kind, unit_a, unit_b
