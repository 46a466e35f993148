-- Expands objects of a world into all objects and parts placed in it, with composed transforms; supplemental parts are
-- no material and left out.
-- Takes world_id and object_nos (array: which of its world_object).
-- Gives number (of an object its place in the tree, parents before children and children in the order of the file; of a
-- part that of the object that it is placed in), child_no (of a part; -1 of objects), object_no, depth (0: placed in the
-- world), path (names joined by /), object_id or -1, part_id or -1, shape_id or -1, world_from_occurrence as m00 .. m23,
-- and of a part the box of its shape, in the shape's frame, as x0 .. z1; in no order: number and child_no have it, and
-- to sort whole rows takes longer than the rest.
-- Objects are walked down by recursion, parts joined to them at the end: parts are most of the rows.
-- Of a robot with rows of world_link those place its links, not object_object.
-- Paths are unique: a slash in a name becomes _; a name that siblings share, that is empty or that holds a # gets # and
-- its ordinal.
WITH RECURSIVE child AS MATERIALIZED (
    SELECT parent_id, child_no, object_id, part_id, segment,
        m00, m01, m02, m03,
        m10, m11, m12, m13,
        m20, m21, m22, m23
    FROM object_child
),
link AS MATERIALIZED (
    SELECT CASE WHEN l.robot = '' THEN w.name ELSE w.name || '/' || l.robot END AS robot, l.object_id, l.child_no,
        l.m00, l.m01, l.m02, l.m03,
        l.m10, l.m11, l.m12, l.m13,
        l.m20, l.m21, l.m22, l.m23
    FROM world_link AS l
    JOIN world_object AS w ON w.world_id = l.world_id AND w.object_no = l.object_no
    WHERE l.world_id = :world_id
),
robot AS (
    SELECT DISTINCT robot AS path FROM link
),
moved AS (  -- links_of: path of the robot whose links these are; empty: children of every other object
    SELECT c.parent_id, '' AS links_of, c.child_no, c.object_id, c.segment,
        c.m00, c.m01, c.m02, c.m03,
        c.m10, c.m11, c.m12, c.m13,
        c.m20, c.m21, c.m22, c.m23
    FROM child AS c
    WHERE c.object_id IS NOT NULL
    UNION ALL
    SELECT c.parent_id, l.robot, c.child_no, c.object_id, c.segment,
        l.m00, l.m01, l.m02, l.m03,
        l.m10, l.m11, l.m12, l.m13,
        l.m20, l.m21, l.m22, l.m23
    FROM link AS l
    JOIN child AS c ON c.parent_id = l.object_id AND c.child_no = l.child_no
    WHERE c.object_id IS NOT NULL
),
placed AS (
    SELECT w.object_no, 0 AS depth, ARRAY[w.object_no] AS ordinals, w.name AS path, v.object_id,
        coalesce(r.path, '') AS links_of,
        w.m00, w.m01, w.m02, w.m03,
        w.m10, w.m11, w.m12, w.m13,
        w.m20, w.m21, w.m22, w.m23
    FROM world_object AS w
    JOIN (SELECT unnest(CAST(:object_nos AS INTEGER[])) AS object_no) AS asked ON asked.object_no = w.object_no
    JOIN object_variant AS v ON v.id = w.object_variant_id
    LEFT JOIN robot AS r ON r.path = w.name
    WHERE w.world_id = :world_id
    UNION ALL
    SELECT p.object_no, p.depth + 1, p.ordinals || ARRAY[c.child_no], p.path || '/' || c.segment, c.object_id,
        coalesce(r.path, ''),
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
    JOIN moved AS c ON c.parent_id = p.object_id AND c.links_of = p.links_of
    LEFT JOIN robot AS r ON r.path = p.path || '/' || c.segment
),
numbered AS MATERIALIZED (
    SELECT row_number() OVER (ORDER BY ordinals) - 1 AS number, object_no, depth, path, object_id,
        m00, m01, m02, m03,
        m10, m11, m12, m13,
        m20, m21, m22, m23
    FROM placed
)
SELECT p.number, -1 AS child_no, p.object_no, p.depth, p.path, p.object_id, -1 AS part_id, -1 AS shape_id,
    p.m00, p.m01, p.m02, p.m03,
    p.m10, p.m11, p.m12, p.m13,
    p.m20, p.m21, p.m22, p.m23,
    CAST(NULL AS DOUBLE PRECISION) AS x0, CAST(NULL AS DOUBLE PRECISION) AS y0, CAST(NULL AS DOUBLE PRECISION) AS z0,
    CAST(NULL AS DOUBLE PRECISION) AS x1, CAST(NULL AS DOUBLE PRECISION) AS y1, CAST(NULL AS DOUBLE PRECISION) AS z1
FROM numbered AS p
UNION ALL
SELECT p.number, c.child_no, p.object_no, p.depth + 1, p.path || '/' || c.segment, -1, c.part_id, part.shape_id,
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
WHERE NOT part.supplemental
