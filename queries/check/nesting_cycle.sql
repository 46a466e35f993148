-- Objects that contain themselves, at whatever depth: of every ring at least one.
-- Takes nothing; gives object_id.
-- A way down from an object that is in no other, longer than there are objects, goes round; what no such way reaches
-- lies in a ring or below one.  Only from these are rings looked for.
WITH RECURSIVE root AS (
    SELECT id AS object_id FROM object WHERE id NOT IN (SELECT child_id FROM object_object)
),
reachable AS (
    SELECT object_id FROM root
    UNION
    SELECT o.child_id
    FROM reachable AS r
    JOIN object_object AS o ON o.parent_id = r.object_id
),
passed AS MATERIALIZED (
    SELECT count(*) AS objects FROM reachable
),
down AS (
    SELECT object_id, 1 AS depth FROM root
    UNION
    SELECT o.child_id, d.depth + 1
    FROM down AS d
    JOIN object_object AS o ON o.parent_id = d.object_id
    WHERE d.depth <= (SELECT objects FROM passed)
),
inside AS (
    SELECT d.object_id AS ancestor_id, o.child_id AS object_id
    FROM (
        SELECT object_id FROM down WHERE depth > (SELECT objects FROM passed)
        UNION
        SELECT id FROM object WHERE id NOT IN (SELECT object_id FROM reachable)
    ) AS d
    JOIN object_object AS o ON o.parent_id = d.object_id
    UNION
    SELECT i.ancestor_id, o.child_id
    FROM inside AS i
    JOIN object_object AS o ON o.parent_id = i.object_id
)
SELECT DISTINCT ancestor_id AS object_id
FROM inside
WHERE ancestor_id = object_id
ORDER BY ancestor_id
