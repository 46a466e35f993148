-- The parts placed in a world.
-- Takes world_id, and run_id of an inspection or null; gives path, shape_id, colour (of the instance, else of the part,
-- or null), whether the cameras saw it at the pose found, and world_from_part as m00 .. m23.
SELECT
    o.path, o.shape_id, coalesce(k.colour, a.value_text) AS colour, v.occurrence_id IS NOT NULL AS in_view,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
FROM occurrence AS o
JOIN placed_node AS above ON above.id = o.parent_id
LEFT JOIN current_part_attribute AS a ON a.part_id = o.part_id AND a.name = 'colour'
LEFT JOIN (
    SELECT object_id, part_id, min(colour) AS colour FROM object_part GROUP BY object_id, part_id
) AS k ON k.object_id = above.object_id AND k.part_id = o.part_id
LEFT JOIN part_in_view AS v ON v.run_id = CAST(:run_id AS BIGINT) AND v.occurrence_id = o.id AND v.level = 'part'
WHERE o.world_id = :world_id AND o.kind = 'part'
ORDER BY o.path
