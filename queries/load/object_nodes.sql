-- Expands an object into itself and all objects and parts in it, each with its transform in the frame of the body that
-- it moves with.
-- Takes object_id of an object that does not contain itself; gives number (of an object its place in the tree, parents
-- before children and children in the order of the file; of a part that of the object that it is placed in), child_no
-- (of a part; -1 of objects), depth (0: the object itself), link (whether it is an object placed in a robot, and so a
-- body of its own, as the object itself is), path (names, a / before each), child_id or -1, part_id or -1, shape_id or
-- -1, body_from_node as m00 .. m23, and of a part the box of its shape, in the shape's frame, as x0 .. z1; in no order:
-- number and child_no have it, and to sort whole rows takes longer than the rest.
-- Objects are walked down by recursion, parts joined to them at the end: parts are most of the rows. Paths are unique:
-- a slash in a name becomes _; a name that siblings share, that is empty or that holds a # gets # and its ordinal.
WITH RECURSIVE child AS MATERIALIZED (
    SELECT parent_id, child_no, object_id, part_id, segment,
        m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_child
),
robot AS (
    SELECT DISTINCT object_id FROM joint
),
moved AS (
    SELECT c.*, r.object_id IS NOT NULL AS link
    FROM child AS c
    LEFT JOIN robot AS r ON r.object_id = c.parent_id
    WHERE c.object_id IS NOT NULL
),
placed AS (  -- an object in a robot is a body, and stands in its own frame
    SELECT 0 AS depth, ARRAY[0] AS ordinals, '' AS path, id AS object_id, FALSE AS link,
        CAST(1 AS DOUBLE PRECISION) AS m00, CAST(0 AS DOUBLE PRECISION) AS m01, CAST(0 AS DOUBLE PRECISION) AS m02, CAST(0 AS DOUBLE PRECISION) AS m03,
        CAST(0 AS DOUBLE PRECISION) AS m10, CAST(1 AS DOUBLE PRECISION) AS m11, CAST(0 AS DOUBLE PRECISION) AS m12, CAST(0 AS DOUBLE PRECISION) AS m13,
        CAST(0 AS DOUBLE PRECISION) AS m20, CAST(0 AS DOUBLE PRECISION) AS m21, CAST(1 AS DOUBLE PRECISION) AS m22, CAST(0 AS DOUBLE PRECISION) AS m23
    FROM object
    WHERE id = :object_id
    UNION ALL
    SELECT p.depth + 1, p.ordinals || ARRAY[c.child_no], p.path || '/' || c.segment, c.object_id, c.link,
        CASE WHEN c.link THEN 1 ELSE p.m00 * c.m00 + p.m01 * c.m10 + p.m02 * c.m20 END,
        CASE WHEN c.link THEN 0 ELSE p.m00 * c.m01 + p.m01 * c.m11 + p.m02 * c.m21 END,
        CASE WHEN c.link THEN 0 ELSE p.m00 * c.m02 + p.m01 * c.m12 + p.m02 * c.m22 END,
        CASE WHEN c.link THEN 0 ELSE p.m00 * c.m03 + p.m01 * c.m13 + p.m02 * c.m23 + p.m03 END,
        CASE WHEN c.link THEN 0 ELSE p.m10 * c.m00 + p.m11 * c.m10 + p.m12 * c.m20 END,
        CASE WHEN c.link THEN 1 ELSE p.m10 * c.m01 + p.m11 * c.m11 + p.m12 * c.m21 END,
        CASE WHEN c.link THEN 0 ELSE p.m10 * c.m02 + p.m11 * c.m12 + p.m12 * c.m22 END,
        CASE WHEN c.link THEN 0 ELSE p.m10 * c.m03 + p.m11 * c.m13 + p.m12 * c.m23 + p.m13 END,
        CASE WHEN c.link THEN 0 ELSE p.m20 * c.m00 + p.m21 * c.m10 + p.m22 * c.m20 END,
        CASE WHEN c.link THEN 0 ELSE p.m20 * c.m01 + p.m21 * c.m11 + p.m22 * c.m21 END,
        CASE WHEN c.link THEN 1 ELSE p.m20 * c.m02 + p.m21 * c.m12 + p.m22 * c.m22 END,
        CASE WHEN c.link THEN 0 ELSE p.m20 * c.m03 + p.m21 * c.m13 + p.m22 * c.m23 + p.m23 END
    FROM placed AS p
    JOIN moved AS c ON c.parent_id = p.object_id
),
numbered AS MATERIALIZED (
    SELECT row_number() OVER (ORDER BY ordinals) - 1 AS number, depth, link, path, object_id,
        m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM placed
)
SELECT p.number, -1 AS child_no, p.depth, p.link, p.path, p.object_id AS child_id, -1 AS part_id, -1 AS shape_id,
    p.m00, p.m01, p.m02, p.m03, p.m10, p.m11, p.m12, p.m13, p.m20, p.m21, p.m22, p.m23,
    CAST(NULL AS DOUBLE PRECISION) AS x0, CAST(NULL AS DOUBLE PRECISION) AS y0, CAST(NULL AS DOUBLE PRECISION) AS z0,
    CAST(NULL AS DOUBLE PRECISION) AS x1, CAST(NULL AS DOUBLE PRECISION) AS y1, CAST(NULL AS DOUBLE PRECISION) AS z1
FROM numbered AS p
UNION ALL
SELECT p.number, c.child_no, p.depth + 1, FALSE, p.path || '/' || c.segment, -1, c.part_id, part.shape_id,
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
    p.m20 * c.m03 + p.m21 * c.m13 + p.m22 * c.m23 + p.m23,
    s.x0, s.y0, s.z0, s.x1, s.y1, s.z1
FROM numbered AS p
JOIN child AS c ON c.parent_id = p.object_id
JOIN part ON part.id = c.part_id
JOIN shape AS s ON s.id = part.shape_id
