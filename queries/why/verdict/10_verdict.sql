-- The verdict and what was missing for acceptance.
-- Takes run; gives sentence.
SELECT concat('run ', run_id, ' is ', verdict, ': ', reason) AS sentence
FROM pose
WHERE run_id = :run
