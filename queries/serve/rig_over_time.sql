-- How a rig did in each usable inspection: how exactly place and rotation were known, how much of the expected evidence was found,
-- how far the edge points of each camera lie from the model.
-- Takes rig (its number; 0: each); gives quantity, run, began_at, serial, value, upper (the most that was allowed; null where there
-- is none), changed (whether it is beyond that) and unit, the oldest first.
SELECT concat('rig ', i.rig_id, ': ', q.quantity) AS quantity, i.run_id AS run, r.began_at, i.serial, q.value, q.upper,
    q.value > q.upper AS changed, q.unit
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
JOIN (
    SELECT run_id, CASE rule WHEN 'translation' THEN 'place known to, two sigma' ELSE 'rotation known to, two sigma' END AS quantity,
        value, gate AS upper, CASE rule WHEN 'translation' THEN 'mm' ELSE 'deg' END AS unit
    FROM why_verdict
    WHERE rule IN ('translation', 'rotation')
    UNION ALL
    SELECT run_id, 'evidence found over what is expected', evidence_ratio, CAST(NULL AS DOUBLE PRECISION), ''
    FROM pose
    UNION ALL
    SELECT run_id, concat('residual of camera ', camera), rms_px, CAST(NULL AS DOUBLE PRECISION), 'px'
    FROM camera_residual
) AS q ON q.run_id = i.run_id
WHERE :rig IN (0, i.rig_id) AND i.verdict = 'accepted'
ORDER BY i.rig_id, q.quantity, i.run_id
