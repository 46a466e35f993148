-- Physical parts that inspections named, each by all its stops, the newest first.
-- Takes nothing; gives serial, part_verdict, findings, checked, features (how many its model has), not_seen, stops,
-- usable_stops, newest (run) and answered (the newest that came to an answer, null where none did).
SELECT o.serial, o.part_verdict, o.findings, o.checked, o.features, o.not_seen, o.stops, o.usable_stops, i.newest, i.answered
FROM serial_outcome AS o
JOIN (
    SELECT serial, max(run_id) AS newest, max(run_id) FILTER (WHERE ended IN ('usable', 'not unique', 'not found')) AS answered
    FROM serial_inspection
    GROUP BY serial
) AS i ON i.serial = o.serial
ORDER BY i.newest DESC
