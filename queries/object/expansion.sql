-- Expands an object into all objects and parts placed in it, with composed transforms.
-- Takes object_id; gives depth (1: placed in the object itself), path (names joined by /, made unique as in
-- world_expansion), object_id or -1, part_id or -1, shape_id or -1 and object_from_occurrence as m00 .. m23; parents
-- before children, children in the order of the file.
WITH RECURSIVE child AS MATERIALIZED (
    SELECT parent_id, child_no, object_id, part_id, segment,
        m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_child
),
placed AS (
    SELECT 1 AS depth, ARRAY[c.child_no] AS ordinals, c.segment AS path, c.object_id, c.part_id,
        c.m00, c.m01, c.m02, c.m03, c.m10, c.m11, c.m12, c.m13, c.m20, c.m21, c.m22, c.m23
    FROM child AS c
    WHERE c.parent_id = :object_id
    UNION ALL
    SELECT p.depth + 1, p.ordinals || ARRAY[c.child_no], p.path || '/' || c.segment, c.object_id,
        c.part_id,
        p.m00 * c.m00 + p.m01 * c.m10 + p.m02 * c.m20,
        p.m00 * c.m01 + p.m01 * c.m11 + p.m02 * c.m21,
        p.m00 * c.m02 + p.m01 * c.m12 + p.m02 * c.m22,
        p.m00 * c.m03 + p.m01 * c.m13 + p.m02 * c.m23 + p.m03,
        p.m10 * c.m00 + p.m11 * c.m10 + p.m12 * c.m20,
        p.m10 * c.m01 + p.m11 * c.m11 + p.m12 * c.m21,
        p.m10 * c.m02 + p.m11 * c.m12 + p.m12 * c.m22,
        p.m10 * c.m03 + p.m11 * c.m13 + p.m12 * c.m23 + p.m13,
        p.m20 * c.m00 + p.m21 * c.m10 + p.m22 * c.m20,
        p.m20 * c.m01 + p.m21 * c.m11 + p.m22 * c.m21,
        p.m20 * c.m02 + p.m21 * c.m12 + p.m22 * c.m22,
        p.m20 * c.m03 + p.m21 * c.m13 + p.m22 * c.m23 + p.m23
    FROM placed AS p
    JOIN child AS c ON c.parent_id = p.object_id
)
SELECT p.depth, p.path, coalesce(p.object_id, -1) AS object_id, coalesce(p.part_id, -1) AS part_id,
    coalesce(part.shape_id, -1) AS shape_id,
    p.m00, p.m01, p.m02, p.m03, p.m10, p.m11, p.m12, p.m13, p.m20, p.m21, p.m22, p.m23
FROM placed AS p
LEFT JOIN part ON part.id = p.part_id
ORDER BY p.ordinals
