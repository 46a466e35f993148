-- How did what was solved of each camera of a rig change over the inspections that were not refused?
SELECT i.rig_id, u.camera, u.name, r.id AS run_id, r.began_at, p.verdict, u.value, u.value - u.expected AS off,
    (u.value - u.expected) / u.sigma AS sigmas
FROM camera_unknown AS u
JOIN inspection AS i ON i.run_id = u.run_id
JOIN pose AS p ON p.run_id = u.run_id AND p.verdict <> 'refused'
JOIN run AS r ON r.id = u.run_id
WHERE u.sigma > 0
ORDER BY i.rig_id, u.camera, u.name, r.id
