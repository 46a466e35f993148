-- Cells of oct-trees that lie in a cell which is not there, or not inside the one that they lie in.
-- Takes nothing; gives world_id and cell.
SELECT c.world_id, c.cell
FROM octree_cell AS c
LEFT JOIN octree_cell AS p ON p.world_id = c.world_id AND p.cell = c.parent
WHERE c.cell = 0 AND c.parent IS NOT NULL
    OR c.parent IS NOT NULL AND (
        p.cell IS NULL OR c.x0 < p.x0 OR c.y0 < p.y0 OR c.z0 < p.z0 OR c.x1 > p.x1 OR c.y1 > p.y1 OR c.z1 > p.z1
    )
ORDER BY c.world_id, c.cell
