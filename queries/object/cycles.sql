-- Objects that contain themselves, directly or through others, among some objects and all in them: of every ring at
-- least one. None in a sound store.
-- Takes object_ids (array); gives name, sorted.
-- A way down that is longer than there are objects goes round: only from its end are rings looked for.
WITH RECURSIVE root AS (
    SELECT id AS object_id FROM object WHERE id = ANY(:object_ids)
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
    FROM down AS d
    JOIN object_object AS o ON o.parent_id = d.object_id
    WHERE d.depth > (SELECT objects FROM passed)
    UNION
    SELECT i.ancestor_id, o.child_id
    FROM inside AS i
    JOIN object_object AS o ON o.parent_id = i.object_id
)
SELECT DISTINCT object.name
FROM inside
JOIN object ON object.id = inside.ancestor_id
WHERE inside.ancestor_id = inside.object_id
ORDER BY object.name
