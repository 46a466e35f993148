-- Of some runs, those that have not ended, whatever else was committed meanwhile.
-- Takes the relation asked_run of run_id; gives run_id and event_no, the ordinal of their next event.
SELECT e.run_id, max(e.event_no) + 1 AS event_no
FROM run_event AS e
WHERE e.run_id IN (SELECT run_id FROM asked_run)
GROUP BY e.run_id
HAVING count(*) FILTER (WHERE e.kind IN ('ended', 'found_dead')) = 0
ORDER BY e.run_id
