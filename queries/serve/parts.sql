-- Physical parts that inspections named, each by all its stops, the newest first.
-- Takes nothing; gives serial, part_verdict, findings, checked, features (how many its model has), not_seen, stops, usable_stops
-- and newest (the newest stop that came to an answer, null where none did).
SELECT o.serial, o.part_verdict, o.findings, o.checked, o.features, o.not_seen, o.stops, o.usable_stops, i.newest
FROM serial_outcome AS o
JOIN (
    SELECT serial, max(run_id) AS last, max(run_id) FILTER (WHERE ended IN ('usable', 'not unique', 'not found')) AS newest
    FROM serial_inspection
    GROUP BY serial
) AS i ON i.serial = o.serial
ORDER BY i.last DESC
