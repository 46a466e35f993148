-- What usable inspections measured more than once or can: sizes of parts and features, and rigs as a whole.
-- Takes nothing; gives name (path, or rig), what, rig (its number; null of sizes), runs and the newest; what most runs
-- measured first.
SELECT p.path AS name, m.what, CAST(NULL AS BIGINT) AS rig, count(DISTINCT m.run_id) AS runs, max(m.run_id) AS newest
FROM measured_size AS m
JOIN presence AS p ON p.run_id = m.run_id AND p.item_no = m.item_no AND p.level <> 'surface'
JOIN inspection AS i ON i.run_id = m.run_id AND i.verdict = 'accepted'
WHERE m.what IN ('diameter', 'shift', 'thickness', 'width')
GROUP BY p.path, m.what
UNION ALL
SELECT concat('rig ', rig_id), 'pose and cameras', rig_id, count(*), max(run_id)
FROM inspection
WHERE verdict = 'accepted'
GROUP BY rig_id
ORDER BY runs DESC, rig NULLS LAST, name, what
