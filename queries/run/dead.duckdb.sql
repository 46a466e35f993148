-- Runs that did not end and are not of this process, which holds the file: their processes are gone.
-- Takes host and process of the asker and when it started; gives run_id and event_no, the ordinal of their next event.
SELECT e.run_id, max(e.event_no) + 1 AS event_no
FROM run_event AS e
JOIN run AS r ON r.id = e.run_id
WHERE NOT (r.host = :host AND r.process = :process AND r.began_at >= :started)
GROUP BY e.run_id
HAVING count(*) FILTER (WHERE e.kind IN ('ended', 'found_dead')) = 0
ORDER BY e.run_id
