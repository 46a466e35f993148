-- The parts placed in a world, for drawing.
-- Takes world_id; gives shape_id, colour (of the instance, else of the part, or null) and world_from_part as m00 ..
-- m23.
SELECT o.shape_id, coalesce(i.colour, p.value_text) AS colour,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
FROM occurrence AS o
JOIN placed_node AS above ON above.id = o.parent_id
LEFT JOIN current_part_attribute AS p ON p.part_id = o.part_id AND p.name = 'colour'
LEFT JOIN (
    SELECT object_id, part_id, min(colour) AS colour FROM object_part GROUP BY object_id, part_id
) AS i ON i.object_id = above.object_id AND i.part_id = o.part_id
WHERE o.world_id = :world_id AND o.kind = 'part'
ORDER BY o.id
