-- The matching problems of a run.
-- Takes run; gives problem_no, kind, method, cost, status and parameters.
SELECT problem_no, kind, method, cost, status, CAST(parameters AS TEXT) AS parameters
FROM problem
WHERE run_id = :run
ORDER BY problem_no
