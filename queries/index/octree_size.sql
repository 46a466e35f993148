-- How many cells the oct-trees of the objects of a world have.
-- Takes world_id; gives cells.
SELECT count(*) AS cells
FROM octree_cell
WHERE object_id IN (SELECT object_id FROM world_object WHERE world_id = :world_id)
