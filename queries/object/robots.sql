-- The robots in an object, itself among them, and the objects on the way to them.
-- Takes object_id of an object that does not contain itself; gives path (empty: the object itself; else as in
-- occurrence, from inside the object), above (path of what contains it, or null), name (in that), object_id, moves (it
-- has joints) and container_from_object at rest as m00 .. m23; containers before what they contain.
WITH RECURSIVE holds AS (  -- objects that are robots or hold some: all others need no walk
    SELECT DISTINCT object_id FROM joint
    UNION
    SELECT o.parent_id FROM holds AS h JOIN object_object AS o ON o.child_id = h.object_id
),
inside AS (
    SELECT 0 AS depth, '' AS path, CAST(NULL AS TEXT) AS above, '' AS name, object_id,
        CAST(1 AS DOUBLE PRECISION) AS m00, CAST(0 AS DOUBLE PRECISION) AS m01, CAST(0 AS DOUBLE PRECISION) AS m02,
        CAST(0 AS DOUBLE PRECISION) AS m03,
        CAST(0 AS DOUBLE PRECISION) AS m10, CAST(1 AS DOUBLE PRECISION) AS m11, CAST(0 AS DOUBLE PRECISION) AS m12,
        CAST(0 AS DOUBLE PRECISION) AS m13,
        CAST(0 AS DOUBLE PRECISION) AS m20, CAST(0 AS DOUBLE PRECISION) AS m21, CAST(1 AS DOUBLE PRECISION) AS m22,
        CAST(0 AS DOUBLE PRECISION) AS m23
    FROM holds
    WHERE object_id = :object_id
    UNION ALL
    SELECT i.depth + 1, CASE WHEN i.path = '' THEN c.segment ELSE i.path || '/' || c.segment END, i.path, o.name,
        c.object_id,
        c.m00, c.m01, c.m02, c.m03, c.m10, c.m11, c.m12, c.m13, c.m20, c.m21, c.m22, c.m23
    FROM inside AS i
    JOIN object_child AS c ON c.parent_id = i.object_id
    JOIN holds AS h ON h.object_id = c.object_id
    JOIN object_object AS o ON o.parent_id = c.parent_id AND o.child_no = c.child_no
)
SELECT i.path, i.above, i.name, i.object_id,
    EXISTS (SELECT 1 FROM joint AS j WHERE j.object_id = i.object_id) AS moves,
    i.m00, i.m01, i.m02, i.m03, i.m10, i.m11, i.m12, i.m13, i.m20, i.m21, i.m22, i.m23
FROM inside AS i
ORDER BY i.depth, i.path
