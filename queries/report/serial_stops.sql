-- The stops of a physical part: its inspections, however they ended.
-- Takes serial; gives one row a stop, the first first; ended: usable, not unique or not found, of its pose, else failed,
-- killed, running or pruned.
SELECT s.run_id AS run, r.began_at, s.ended, o.part_verdict, o.findings, o.checked, o.in_view, s.reason
FROM serial_inspection AS s
JOIN run AS r ON r.id = s.run_id
LEFT JOIN inspection_outcome AS o ON o.run_id = s.run_id
WHERE s.serial = :serial
ORDER BY s.run_id
