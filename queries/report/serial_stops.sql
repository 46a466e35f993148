-- The inspections of a physical part.
-- Takes serial; gives one row an inspection, the first first.
SELECT i.run_id AS run, r.began_at, o.pose_verdict, o.part_verdict, o.findings, o.checked, o.in_view, i.reason
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
JOIN inspection_outcome AS o ON o.run_id = i.run_id
WHERE i.serial = :serial
ORDER BY i.run_id
