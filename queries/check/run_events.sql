-- Runs that did not begin with their begun event, ended twice, or whose steps do not add up to what the run took.
-- Takes nothing; gives run_id.
SELECT r.id AS run_id
FROM run AS r
LEFT JOIN run_event AS e ON e.run_id = r.id
GROUP BY r.id
HAVING count(*) FILTER (WHERE e.kind = 'begun' AND e.event_no = 0) <> 1
    OR count(*) FILTER (WHERE e.kind IN ('ended', 'found_dead')) > 1
    OR abs(sum(CASE e.kind WHEN 'step' THEN e.seconds END) - max(CASE e.kind WHEN 'ended' THEN e.seconds END)) > 1e-6
ORDER BY r.id
