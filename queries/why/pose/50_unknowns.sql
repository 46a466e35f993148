-- What its pictures show of the cameras, beside what was expected.
-- Takes run; gives sentence.
SELECT concat('of the ', camera, ' camera the pictures show ', name, ' as ', CAST(value AS NUMERIC(18, 5)), ' +- ',
    CAST(sigma_shown AS NUMERIC(18, 5)), ' (expected ', CAST(expected AS NUMERIC(18, 5)), ')') AS sentence
FROM camera_unknown
WHERE run_id = :run AND sigma > 0
ORDER BY camera, name
