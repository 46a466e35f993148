-- What usable inspections measured more than once or can: sizes of parts and features, residuals of cameras, and rigs as a
-- whole.
-- Takes nothing; gives name (path, or rig and camera), what, rig (its number; null of sizes), camera (likewise), runs and the
-- newest; what most runs measured first.
SELECT p.path AS name, m.what, CAST(NULL AS BIGINT) AS rig, CAST(NULL AS TEXT) AS camera, count(DISTINCT m.run_id) AS runs,
    max(m.run_id) AS newest
FROM measured_size AS m
JOIN presence AS p ON p.run_id = m.run_id AND p.item_no = m.item_no AND p.level <> 'surface'
JOIN inspection AS i ON i.run_id = m.run_id AND i.verdict = 'accepted'
WHERE m.what IN ('diameter', 'shift', 'thickness', 'width')
GROUP BY p.path, m.what
UNION ALL
SELECT concat('rig ', i.rig_id, ' camera ', v.camera), 'residual', i.rig_id, v.camera, count(DISTINCT i.run_id), max(i.run_id)
FROM inspection AS i
JOIN inspection_image AS v ON v.run_id = i.run_id
WHERE i.verdict = 'accepted'
GROUP BY i.rig_id, v.camera
UNION ALL
SELECT concat('rig ', rig_id), 'all', rig_id, NULL, count(*), max(run_id)
FROM inspection
WHERE verdict = 'accepted'
GROUP BY rig_id
ORDER BY runs DESC, rig NULLS LAST, name, what
