-- Whether what a run found was pruned.
-- Takes run; gives by_run_id.
SELECT by_run_id
FROM pruned_run
WHERE run_id = :run AND what = 'runs'
