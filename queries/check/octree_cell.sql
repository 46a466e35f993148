-- Cells of oct-trees that lie in a cell which is not there, or not inside the one that they lie in.
-- Takes nothing; gives object_id and cell.
SELECT c.object_id, c.cell
FROM octree_cell AS c
LEFT JOIN octree_cell AS p ON p.object_id = c.object_id AND p.cell = c.parent AND p.body_no = c.body_no
WHERE c.cell = 0 AND c.parent IS NOT NULL
    OR c.parent IS NOT NULL AND (
        p.cell IS NULL OR c.x0 < p.x0 OR c.y0 < p.y0 OR c.z0 < p.z0 OR c.x1 > p.x1 OR c.y1 > p.y1 OR c.z1 > p.z1
    )
ORDER BY c.object_id, c.cell
