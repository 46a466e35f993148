-- The joints of a loaded object, those that carry others before them; no row where it is no robot.
-- Takes object_variant_id.
-- Gives name, kind, parent_link, child_link, axis_x .. axis_z, lower_limit, upper_limit, mimic_joint, mimic_factor,
-- mimic_offset, and parent_from_joint as m00 .. m23.
SELECT j.name, j.kind, j.parent_link, j.child_link, j.axis_x, j.axis_y, j.axis_z, j.lower_limit, j.upper_limit,
    j.mimic_joint, j.mimic_factor, j.mimic_offset,
    j.m00, j.m01, j.m02, j.m03,
    j.m10, j.m11, j.m12, j.m13,
    j.m20, j.m21, j.m22, j.m23
FROM object_variant AS v
JOIN joint AS j ON j.object_id = v.object_id
WHERE v.id = :object_variant_id
ORDER BY j.joint_no
