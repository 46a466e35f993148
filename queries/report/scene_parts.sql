-- The placed parts of a world, those first that an inspection has in view, to be drawn.
-- Takes world_id, run_id (null: of none) and most (how many); gives one row a part.
SELECT o.id, o.path, o.shape_id, o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    CASE WHEN p.occurrence_id IS NULL THEN 0 ELSE 1 END AS in_view
FROM occurrence AS o
LEFT JOIN part_in_view AS p ON p.run_id = :run_id AND p.occurrence_id = o.id AND p.level = 'part'
WHERE o.world_id = :world_id AND o.kind = 'part'
ORDER BY in_view DESC, o.id
LIMIT :most
