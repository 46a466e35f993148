-- What objects of given names hold directly.
-- Takes the relation sought (name); gives id and name of the object, child_no and parent_from_child m00 .. m23, in
-- order of id and child_no.
SELECT o.id, o.name, c.child_no,
    c.m00, c.m01, c.m02, c.m03,
    c.m10, c.m11, c.m12, c.m13,
    c.m20, c.m21, c.m22, c.m23
FROM sought
JOIN object AS o ON o.name = sought.name
JOIN (
    SELECT object_id, child_no, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_part
    UNION ALL
    SELECT parent_id, child_no, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_object
) AS c ON c.object_id = o.id
ORDER BY o.id, c.child_no
