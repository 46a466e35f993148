-- Which objects hold which directly, of some objects and all in them.
-- Takes object_ids (array); gives parent_id, its name and child_id, one row each, in order.
WITH RECURSIVE inside AS (
    SELECT id AS object_id FROM object WHERE id = ANY(:object_ids)
    UNION
    SELECT o.child_id
    FROM inside AS i
    JOIN object_object AS o ON o.parent_id = i.object_id
)
SELECT DISTINCT o.parent_id, p.name, o.child_id
FROM inside AS i
JOIN object_object AS o ON o.parent_id = i.object_id
JOIN object AS p ON p.id = o.parent_id
ORDER BY o.parent_id, o.child_id
