-- The placed parts of the world of an inspection, those in view first, to be drawn.
-- Takes run_id and most (how many); gives one row a part.
SELECT o.id, o.path, o.shape_id, o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    CASE WHEN p.occurrence_id IS NULL THEN 0 ELSE 1 END AS in_view
FROM inspection AS i
JOIN occurrence AS o ON o.world_id = i.world_id AND o.kind = 'part'
LEFT JOIN part_in_view AS p ON p.run_id = i.run_id AND p.occurrence_id = o.id AND p.level = 'part'
WHERE i.run_id = :run_id
ORDER BY in_view DESC, o.id
LIMIT :most
