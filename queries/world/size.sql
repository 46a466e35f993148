-- How many objects and parts a world holds.
-- Takes world_id; gives objects and parts.
WITH expanded AS (
    SELECT object_id, count(*) - count(part_id) AS objects, count(part_id) AS parts
    FROM object_node
    WHERE object_id IN (SELECT object_id FROM world_object WHERE world_id = :world_id)
    GROUP BY object_id
)
SELECT coalesce(sum(e.objects), 0) AS objects, coalesce(sum(e.parts), 0) AS parts
FROM world_object AS w
JOIN expanded AS e ON e.object_id = w.object_id
WHERE w.world_id = :world_id
