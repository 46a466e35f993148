-- Runs that did not begin with their begun event, or ended twice.
-- Takes nothing; gives run_id.
SELECT r.id AS run_id
FROM run AS r
LEFT JOIN run_event AS e ON e.run_id = r.id
GROUP BY r.id
HAVING count(*) FILTER (WHERE e.kind = 'begun' AND e.event_no = 0) <> 1
    OR count(*) FILTER (WHERE e.kind IN ('ended', 'found_dead')) > 1
ORDER BY r.id
