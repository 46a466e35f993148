-- What happened in a run, and how long each step took.
-- Takes run_id; gives one row an event, in order; seconds.
SELECT kind, name, seconds, state, message
FROM run_event
WHERE run_id = :run_id
ORDER BY event_no
