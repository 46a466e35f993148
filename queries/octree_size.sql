-- How large the oct-tree of a world is.
-- Takes world_id.
-- Gives cells, 0 where none was written, and last_cell, the last of them, -1 where none was.
SELECT count(*) AS cells, coalesce(max(cell), -1) AS last_cell FROM octree_cell WHERE world_id = :world_id
