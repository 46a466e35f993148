-- The rigs and objects that a world mounts, each with the object that carries it.
-- Takes world_id; gives rig (its name) and rig_id (both null of objects), mounted_no (object_no of an object; null of
-- rigs), carrier (the name of what carries it), its object_no and object_id, link or null, carrier_from_mounted as m00
-- .. m23 and world_from_carrier as w00 .. w23, in order.
SELECT CASE WHEN m.rig_id IS NOT NULL THEN m.name END AS rig, m.rig_id, m.mounted_no, o.name AS carrier, m.object_no, o.object_id,
    m.link, m.m00, m.m01, m.m02, m.m03, m.m10, m.m11, m.m12, m.m13, m.m20, m.m21, m.m22, m.m23,
    o.m00 AS w00, o.m01 AS w01, o.m02 AS w02, o.m03 AS w03,
    o.m10 AS w10, o.m11 AS w11, o.m12 AS w12, o.m13 AS w13,
    o.m20 AS w20, o.m21 AS w21, o.m22 AS w22, o.m23 AS w23
FROM world AS w
JOIN world_mount AS m ON m.world = w.name
    AND w.revision BETWEEN m.first_revision AND coalesce(m.last_revision, w.revision)
JOIN world_object AS o ON o.world_id = w.id AND o.object_no = m.object_no
WHERE w.id = :world_id
ORDER BY m.mount_no
