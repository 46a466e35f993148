-- What stands in a world as it stood in the revision before: its occurrences are copied, each with its page.
-- Takes world_id, previous (the revision before), shift (by which the copies' identities are larger), was_no and now_no
-- (arrays of one length: the ordinals that each kept object of the world had and has).
-- Gives nothing.
INSERT INTO occurrence (
    id, world_id, parent_id, object_no, kind, path, object_id, part_id, shape_id,
    m00, m01, m02, m03,
    m10, m11, m12, m13,
    m20, m21, m22, m23,
    page, x0, y0, z0, x1, y1, z1
)
SELECT o.id + :shift, :world_id, o.parent_id + :shift, k.now_no, o.kind, o.path, o.object_id, o.part_id, o.shape_id,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23,
    o.page, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM (
    SELECT unnest(CAST(:was_no AS INTEGER[])) AS was_no, unnest(CAST(:now_no AS INTEGER[])) AS now_no
) AS k
JOIN occurrence AS o ON o.object_no = k.was_no
WHERE o.world_id = :previous
ORDER BY o.id
