-- How long the steps of the newest run of each kind took that did what it was asked.
-- Takes nothing; gives kind, name and seconds, in order; a run without steps is one, without a name.
WITH newest AS (
    SELECT r.kind, max(r.id) AS run_id
    FROM run AS r
    JOIN run_event AS e ON e.run_id = r.id AND e.kind = 'ended' AND e.state = 'finished'
    GROUP BY r.kind
)
SELECT n.kind, e.name, e.seconds
FROM newest AS n
JOIN run_event AS e ON e.run_id = n.run_id
WHERE e.kind = 'step' OR e.kind = 'ended'
    AND NOT EXISTS (SELECT 1 FROM run_event AS s WHERE s.run_id = n.run_id AND s.kind = 'step')
ORDER BY n.kind, e.event_no
