-- Placed parts of a world with their role and transform.
-- Takes world_id; gives one row a placed part, in order of its identity; object_no: of the object of the world that it
-- belongs to.
SELECT o.id, o.object_no, o.path, o.shape_id, w.role, w.tolerance_mm,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
FROM occurrence AS o
JOIN world_object AS w ON w.world_id = o.world_id AND w.object_no = o.object_no
WHERE o.world_id = :world_id AND o.kind = 'part'
ORDER BY o.id
