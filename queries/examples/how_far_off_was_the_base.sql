-- How far off was the arm's base in the last ten runs that corrected it, and how surely (two standard deviations, of all axes together)?
SELECT c.run_id, r.began_at, w.world, CASE WHEN c.robot = '' THEN w.name ELSE w.name || '/' || c.robot END AS base,
    c.shift_x, c.shift_y, c.shift_z,
    sqrt(c.shift_x * c.shift_x + c.shift_y * c.shift_y + c.shift_z * c.shift_z) AS shift,
    2 * sqrt(c.covariance[1] + c.covariance[8] + c.covariance[15]) AS shift_within,
    degrees(sqrt(c.turn_x * c.turn_x + c.turn_y * c.turn_y + c.turn_z * c.turn_z)) AS turn,
    degrees(2 * sqrt(c.covariance[22] + c.covariance[29] + c.covariance[36])) AS turn_within
FROM base_correction AS c
JOIN run AS r ON r.id = c.run_id
JOIN placed_object AS w ON w.object_no = c.object_no
ORDER BY c.run_id DESC, c.base_no
LIMIT 10
