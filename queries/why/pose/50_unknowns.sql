-- What was solved of the cameras along with it.
-- Takes run; gives sentence.
SELECT concat('of the ', camera, ' camera ', name, ' was solved as ', CAST(value AS NUMERIC(18, 5)), ' (expected ',
    CAST(expected AS NUMERIC(18, 5)), ', sigma ', CAST(sigma AS NUMERIC(18, 5)), ')') AS sentence
FROM camera_unknown
WHERE run_id = :run AND sigma > 0
ORDER BY camera, name
