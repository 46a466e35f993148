-- The parts placed in a world, to be drawn.
-- Takes world (its name) and most (how many); gives path, shape_id and world_from_part as m00 .. m23.
SELECT o.path, o.shape_id, o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
FROM current_world AS w
JOIN occurrence AS o ON o.world_id = w.world_id AND o.kind = 'part'
WHERE w.name = :world
ORDER BY o.id
LIMIT :most
