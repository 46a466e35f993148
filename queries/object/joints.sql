-- The joints of an object, those that carry others before them; no row where it is no robot.
-- Takes object_id; gives name, kind, parent_link, child_link, axis_x .. axis_z, lower_limit, upper_limit, mimic_joint,
-- mimic_factor, mimic_offset, and parent_from_joint as m00 .. m23.
SELECT name, kind, parent_link, child_link, axis_x, axis_y, axis_z, lower_limit, upper_limit,
    mimic_joint, mimic_factor, mimic_offset,
    m00, m01, m02, m03,
    m10, m11, m12, m13,
    m20, m21, m22, m23
FROM joint
WHERE object_id = :object_id
ORDER BY joint_no
