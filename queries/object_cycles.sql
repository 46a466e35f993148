-- Objects of a world that contain themselves, directly or through others: none in a sound store.
-- Takes world_id.  Gives name, sorted.
WITH RECURSIVE reachable AS (
    SELECT v.object_id
    FROM world_object AS w
    JOIN object_variant AS v ON v.id = w.object_variant_id
    WHERE w.world_id = :world_id
    UNION
    SELECT o.child_id
    FROM reachable AS r
    JOIN object_object AS o ON o.parent_id = r.object_id
),
inside AS (
    SELECT parent_id AS ancestor_id, child_id AS object_id
    FROM object_object
    WHERE parent_id IN (SELECT object_id FROM reachable)
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
