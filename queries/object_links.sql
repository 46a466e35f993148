-- What stands directly in a loaded object, that a rig may be mounted on: its links, objects and parts.
-- Takes object_variant_id.  Gives child_no, name, object_from_link as m00 .. m23, in order.
WITH link AS (
    SELECT parent_id AS object_id, child_no, name,
        m00, m01, m02, m03,
        m10, m11, m12, m13,
        m20, m21, m22, m23
    FROM object_object
    UNION ALL
    SELECT object_id, child_no, name,
        m00, m01, m02, m03,
        m10, m11, m12, m13,
        m20, m21, m22, m23
    FROM object_part
)
SELECT l.child_no, l.name,
    l.m00, l.m01, l.m02, l.m03,
    l.m10, l.m11, l.m12, l.m13,
    l.m20, l.m21, l.m22, l.m23
FROM object_variant AS v
JOIN link AS l ON l.object_id = v.object_id
WHERE v.id = :object_variant_id
ORDER BY l.child_no
