-- How large the oct-tree of a world is.
-- takes: world_id
-- gives: cells, 0 where none was written
SELECT count(*) AS cells FROM octree_cell WHERE world_id = :world_id
