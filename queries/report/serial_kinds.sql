-- How much of a physical part is checked, by kind of feature.
-- Takes serial; gives one row a kind, parts first.
SELECT coalesce(k.kind, 'part') AS kind, count(*) AS features,
    count(CASE WHEN s.state IN ('confirmed', 'changed', 'contradicted') THEN 1 END) AS checked,
    count(CASE WHEN s.state IN ('changed', 'contradicted') THEN 1 END) AS failed,
    count(CASE s.state WHEN 'not_seen' THEN 1 END) AS not_yet_seen
FROM serial_evidence AS s
JOIN placed_node AS n ON n.id = s.occurrence_id
LEFT JOIN feature AS f ON f.shape_id = n.shape_id AND f.feature_no = s.feature_no
LEFT JOIN feature_class AS k ON k.id = f.feature_class_id
WHERE s.serial = :serial
GROUP BY coalesce(k.kind, 'part')
ORDER BY CASE coalesce(k.kind, 'part') WHEN 'part' THEN 0 ELSE 1 END, features DESC, kind
