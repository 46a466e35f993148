-- The objects of a world whose parts lie in no oct-tree.
-- Takes world_id; gives object_id, sorted.
SELECT DISTINCT w.object_id
FROM world_object AS w
JOIN object_page AS p ON p.object_id = w.object_id
WHERE w.world_id = :world_id AND NOT EXISTS (SELECT 1 FROM octree_cell AS c WHERE c.object_id = w.object_id)
ORDER BY w.object_id
