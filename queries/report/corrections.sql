-- Where the base of each arm that carries a rig stands by the pose found, and how surely (standard deviations).
-- Takes run_id; gives one row a base; mm, degrees.
SELECT CASE WHEN c.robot = '' THEN w.name ELSE w.name || '/' || c.robot END AS base, c.shift_x, c.shift_y, c.shift_z,
    degrees(c.turn_x) AS turn_x_deg, degrees(c.turn_y) AS turn_y_deg, degrees(c.turn_z) AS turn_z_deg,
    sqrt(c.covariance[1]) AS sigma_x, sqrt(c.covariance[8]) AS sigma_y, sqrt(c.covariance[15]) AS sigma_z
FROM base_correction AS c
JOIN placed_object AS w ON w.object_no = c.object_no
WHERE c.run_id = :run_id
ORDER BY c.base_no
