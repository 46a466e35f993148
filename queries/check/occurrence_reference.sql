-- Placed objects and parts that point at a world, object, part, shape or container which is not there.
-- Takes nothing; gives occurrence_id, path and what is missing.
SELECT o.id AS occurrence_id, o.path,
    CASE WHEN w.id IS NULL THEN 'world' WHEN o.object_id IS NOT NULL AND b.id IS NULL THEN 'object'
        WHEN o.part_id IS NOT NULL AND p.id IS NULL THEN 'part' WHEN o.part_id IS NOT NULL AND s.id IS NULL THEN 'shape'
        ELSE 'container' END AS missing
FROM occurrence AS o
LEFT JOIN world AS w ON w.id = o.world_id
LEFT JOIN object AS b ON b.id = o.object_id
LEFT JOIN part AS p ON p.id = o.part_id
LEFT JOIN shape AS s ON s.id = o.shape_id AND s.id = p.shape_id
LEFT JOIN occurrence AS above ON above.id = o.parent_id AND above.world_id = o.world_id AND above.kind = 'object'
WHERE w.id IS NULL OR o.object_id IS NOT NULL AND b.id IS NULL OR o.part_id IS NOT NULL AND (p.id IS NULL OR s.id IS NULL)
    OR o.parent_id IS NOT NULL AND above.id IS NULL OR o.kind = 'part' AND o.parent_id IS NULL
ORDER BY o.id
