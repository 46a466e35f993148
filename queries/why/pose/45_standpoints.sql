-- Where each standpoint is, of an inspection of several.
-- Takes run; gives sentence.
SELECT concat('standpoint ', name, CASE
        WHEN ignored THEN ' was left out'
        WHEN sigmas IS NULL THEN ' had no part in it'
        ELSE concat(' is ', CAST(sqrt(power(moved[1], 2) + power(moved[2], 2) + power(moved[3], 2)) AS NUMERIC(18, 3)), ' mm and ',
            CAST(degrees(sqrt(power(moved[4], 2) + power(moved[5], 2) + power(moved[6], 2))) AS NUMERIC(18, 3)),
            ' degrees from where it was stated to be (', CAST(sigmas AS NUMERIC(18, 1)), ' sigma)')
        END) AS sentence
FROM standpoint
WHERE run_id = :run
ORDER BY standpoint_no
