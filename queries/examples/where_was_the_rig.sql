-- Where in the world was the rig at the newest inspection, and how sure is that along the axes (standard deviations, mm)?
SELECT p.verdict, p.x, p.y, p.z, p.sigma_x, p.sigma_y, p.sigma_z
FROM pose_world AS p
WHERE p.run_id = (SELECT max(pose.run_id) FROM pose)
