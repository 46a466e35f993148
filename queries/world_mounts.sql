-- The rigs and objects that a world mounts, each with the object that carries it.
-- Takes world_id.
-- Gives rig (its name) and rig_id (both null of objects), mounted_no (object_no of an object; null of rigs), carrier (the
-- name of what carries it), its object_no and object_id, link or null, carrier_from_mounted as m00 .. m23 and
-- world_from_carrier as w00 .. w23, in order.
SELECT CASE WHEN m.rig_id IS NOT NULL THEN m.name END AS rig, m.rig_id, m.mounted_no, w.name AS carrier, m.object_no, v.object_id,
    m.link,
    m.m00, m.m01, m.m02, m.m03,
    m.m10, m.m11, m.m12, m.m13,
    m.m20, m.m21, m.m22, m.m23,
    w.m00 AS w00, w.m01 AS w01, w.m02 AS w02, w.m03 AS w03,
    w.m10 AS w10, w.m11 AS w11, w.m12 AS w12, w.m13 AS w13,
    w.m20 AS w20, w.m21 AS w21, w.m22 AS w22, w.m23 AS w23
FROM world_mount AS m
JOIN world_object AS w ON w.world_id = m.world_id AND w.object_no = m.object_no
JOIN object_variant AS v ON v.id = w.object_variant_id
WHERE m.world_id = :world_id
ORDER BY m.mount_no
