-- What objects of given names hold directly.
-- Takes the relation sought (name); gives id and name of the object, child_no and parent_from_child m00 .. m23, in
-- order of id and child_no.
SELECT o.id, o.name, c.child_no,
    c.m00, c.m01, c.m02, c.m03, c.m10, c.m11, c.m12, c.m13, c.m20, c.m21, c.m22, c.m23
FROM sought
JOIN object AS o ON o.name = sought.name
JOIN object_child AS c ON c.parent_id = o.id
ORDER BY o.id, c.child_no
