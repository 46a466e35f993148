-- Placed parts whose world box meets a box, by a walk down the oct-tree of the world; touching counts.
-- Takes x0, y0, z0, x1, y1, z1 (mm, world) and world_id of a world whose oct-tree was written.
-- Gives occurrence_id, in order.
WITH RECURSIVE walk (cell) AS (
    SELECT cell
    FROM octree_cell
    WHERE world_id = :world_id AND parent IS NULL
        AND x0 <= :x1 AND y0 <= :y1 AND z0 <= :z1 AND x1 >= :x0 AND y1 >= :y0 AND z1 >= :z0
    UNION ALL
    SELECT c.cell
    FROM walk AS w
    JOIN octree_cell AS c ON c.world_id = :world_id AND c.parent = w.cell
        AND c.x0 <= :x1 AND c.y0 <= :y1 AND c.z0 <= :z1 AND c.x1 >= :x0 AND c.y1 >= :y0 AND c.z1 >= :z0
)
SELECT DISTINCT b.occurrence_id
FROM walk AS w
JOIN octree_entry AS e ON e.world_id = :world_id AND e.cell = w.cell
JOIN occurrence_box AS b ON b.occurrence_id = e.occurrence_id
    AND b.x0 <= :x1 AND b.y0 <= :y1 AND b.z0 <= :z1 AND b.x1 >= :x0 AND b.y1 >= :y0 AND b.z1 >= :z0
ORDER BY b.occurrence_id
