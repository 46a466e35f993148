-- What was solved of the cameras of an inspection.
-- Takes run; gives camera, name, value, expected, sigma, considered and before.
SELECT camera, name, value, expected, sigma, considered, before
FROM camera_unknown
WHERE run_id = :run
ORDER BY camera, name
