-- What stands directly in an object, that a rig or an object may be mounted on: its links, objects and parts.
-- Takes object_id; gives child_no, name, segment (of its path) and object_from_link as m00 .. m23, in order.
SELECT c.child_no, coalesce(o.name, p.name) AS name, c.segment,
    c.m00, c.m01, c.m02, c.m03, c.m10, c.m11, c.m12, c.m13, c.m20, c.m21, c.m22, c.m23
FROM object_child AS c
LEFT JOIN object_object AS o ON o.parent_id = c.parent_id AND o.child_no = c.child_no AND c.part_id IS NULL
LEFT JOIN object_part AS p ON p.object_id = c.parent_id AND p.child_no = c.child_no AND c.object_id IS NULL
WHERE c.parent_id = :object_id
ORDER BY c.child_no
