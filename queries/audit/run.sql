-- A run as it is listed.
-- Takes run; gives kind, state, verdict, message, seconds and began_at.
SELECT kind, state, verdict, message, seconds, began_at
FROM run_summary
WHERE run_id = :run
