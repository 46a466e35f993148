-- Runs that did not end; their processes may live.
-- Takes nothing; gives run_id and event_no, the ordinal of their next event.
SELECT run_id, max(event_no) + 1 AS event_no
FROM run_event
GROUP BY run_id
HAVING count(*) FILTER (WHERE kind IN ('ended', 'found_dead')) = 0
ORDER BY run_id
