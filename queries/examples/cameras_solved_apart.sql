-- How far from the pose found does each camera put the rig by itself, in mm?
SELECT a.run_id, p.verdict, a.camera,
    sqrt(power(a.m03 - p.m03, 2) + power(a.m13 - p.m13, 2) + power(a.m23 - p.m23, 2)) AS apart,
    2 * sqrt(a.covariance[1] + a.covariance[8] + a.covariance[15]) AS known_to
FROM solved_pose AS a
JOIN pose AS p ON p.run_id = a.run_id
WHERE a.kind = 'single_camera' AND a.run_id = (SELECT max(pose.run_id) FROM pose)
ORDER BY a.camera
