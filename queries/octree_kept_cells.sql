-- The cells of the oct-tree of the revision before serve a world whose parts were copied from it.
-- Takes world_id and previous (the revision before).
-- Gives nothing.
INSERT INTO octree_cell (world_id, cell, parent, x0, y0, z0, x1, y1, z1)
SELECT :world_id, c.cell, c.parent, c.x0, c.y0, c.z0, c.x1, c.y1, c.z1
FROM octree_cell AS c
WHERE c.world_id = :previous
ORDER BY c.cell
