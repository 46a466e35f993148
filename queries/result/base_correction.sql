-- Where the base of each arm stands that carries a rig, by an accepted pose.
-- Takes run_id; gives base_no, the base, how far it is shifted (mm) and turned (rad), world_from_base as m00 .. m23, covariance.
SELECT c.base_no, w.name AS object, c.robot, c.shift_x, c.shift_y, c.shift_z, c.turn_x, c.turn_y, c.turn_z,
    c.m00, c.m01, c.m02, c.m03, c.m10, c.m11, c.m12, c.m13, c.m20, c.m21, c.m22, c.m23, c.covariance
FROM base_correction AS c
JOIN placed_object AS w ON w.object_no = c.object_no
WHERE c.run_id = :run_id
ORDER BY c.base_no
