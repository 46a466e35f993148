-- Physical parts that inspections named, each by all its stops.
-- Takes nothing; gives serial, part_verdict, findings, checked, features (how many its model has), not_seen, stops, usable_stops
-- and newest (run), the newest first.
SELECT o.serial, o.part_verdict, o.findings, o.checked, o.features, o.not_seen, o.stops, o.usable_stops, i.newest
FROM serial_outcome AS o
JOIN (SELECT serial, max(run_id) AS newest FROM serial_inspection GROUP BY serial) AS i ON i.serial = o.serial
ORDER BY i.newest DESC
