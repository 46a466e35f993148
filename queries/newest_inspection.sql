-- The latest run that left an answer; null where there is none.
SELECT max(run_id) AS run_id
FROM pose
