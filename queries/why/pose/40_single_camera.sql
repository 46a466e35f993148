-- How far the pose that each camera gives by itself lies from it.
-- Takes run; gives sentence.
SELECT concat('the ', a.camera, ' picture by itself puts the rig ',
    CAST(sqrt(power(a.m03 - p.m03, 2) + power(a.m13 - p.m13, 2) + power(a.m23 - p.m23, 2)) AS NUMERIC(18, 3)),
    ' mm from there') AS sentence
FROM solved_pose AS a
JOIN pose AS p ON p.run_id = a.run_id
WHERE a.kind = 'single_camera' AND a.run_id = :run
ORDER BY a.camera
