-- What stands directly in an object, that a rig may be mounted on: its links, objects and parts.
-- Takes object_id.  Gives child_no, name, object_from_link as m00 .. m23, in order.
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
SELECT child_no, name,
    m00, m01, m02, m03,
    m10, m11, m12, m13,
    m20, m21, m22, m23
FROM link
WHERE object_id = :object_id
ORDER BY child_no
