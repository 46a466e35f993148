-- How much of a physical part is checked: by kind of feature, then by zone, a letter along its longest side and a number along
-- the next.
-- Takes serial; gives one row a kind or zone, parts first.
SELECT CASE WHEN s.zone IS NULL THEN 'kind' ELSE 'zone' END AS what, coalesce(s.zone, s.kind) AS name, count(*) AS features,
    count(CASE WHEN s.state IN ('confirmed', 'changed', 'contradicted') THEN 1 END) AS checked,
    count(CASE WHEN s.state IN ('changed', 'contradicted') THEN 1 END) AS failed,
    count(CASE s.state WHEN 'not_seen' THEN 1 END) AS not_yet_seen
FROM (
    SELECT e.zone, coalesce(k.kind, 'part') AS kind, e.state
    FROM serial_evidence AS e
    JOIN placed_node AS n ON n.id = e.occurrence_id
    LEFT JOIN feature AS f ON f.shape_id = n.shape_id AND f.feature_no = e.feature_no
    LEFT JOIN feature_class AS k ON k.id = f.feature_class_id
    WHERE e.serial = :serial
) AS s
GROUP BY GROUPING SETS ((s.kind), (s.zone))
ORDER BY what, CASE s.kind WHEN 'part' THEN 0 ELSE 1 END, CASE WHEN s.zone IS NULL THEN count(*) ELSE 0 END DESC, name
