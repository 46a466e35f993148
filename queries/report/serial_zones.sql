-- How much of a physical part is checked, by zone: a letter along its longest side, a number along the next.
-- Takes serial; gives one row a zone.
SELECT zone, count(*) AS features, count(CASE WHEN state IN ('confirmed', 'changed', 'contradicted') THEN 1 END) AS checked,
    count(CASE WHEN state IN ('changed', 'contradicted') THEN 1 END) AS failed,
    count(CASE state WHEN 'not_seen' THEN 1 END) AS not_yet_seen
FROM serial_evidence
WHERE serial = :serial
GROUP BY zone
ORDER BY zone
