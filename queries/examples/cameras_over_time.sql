-- How did what was solved of each camera change from inspection to inspection?
SELECT u.camera, u.name, r.began_at, u.value, u.value - u.expected AS off, (u.value - u.expected) / u.sigma AS sigmas
FROM camera_unknown AS u
JOIN run AS r ON r.id = u.run_id
WHERE u.sigma > 0
ORDER BY u.camera, u.name, r.began_at
