-- The verdict with what is not as the model says.
-- Takes run; gives sentence.
SELECT concat('run ', run_id, ': ', outcome) AS sentence
FROM inspection_outcome
WHERE run_id = :run
