-- What each picture says for it.
-- Takes run; gives sentence.
SELECT concat('the ', camera, ' picture gives evidence of ', CAST(evidence AS NUMERIC(18, 1)), ' for it: ',
    CAST(found AS NUMERIC(18, 1)), ' found on ', CAST(length_px AS NUMERIC(18, 0)), ' px of model arcs, of ',
    CAST(expected AS NUMERIC(18, 1)), ' expected') AS sentence
FROM hypothesis_support
WHERE run_id = :run AND hypothesis_no = 0
ORDER BY camera
