-- Placed parts that an oct-tree of their world does not list in a leaf which they touch, or lists where they touch none.
-- Takes nothing; gives world_id, occurrence_id and cell (null: of a leaf that lists it nowhere).
WITH listed AS (
    SELECT e.world_id, e.occurrence_id, e.cell
    FROM octree_entry AS e
    LEFT JOIN octree_cell AS c ON c.world_id = e.world_id AND c.cell = e.cell
    LEFT JOIN occurrence_box AS b ON b.occurrence_id = e.occurrence_id AND b.world_id = e.world_id
    WHERE c.cell IS NULL OR b.occurrence_id IS NULL
        OR b.x0 > c.x1 OR b.y0 > c.y1 OR b.z0 > c.z1 OR b.x1 < c.x0 OR b.y1 < c.y0 OR b.z1 < c.z0
)
SELECT world_id, occurrence_id, cell FROM listed
UNION ALL
SELECT b.world_id, b.occurrence_id, NULL
FROM occurrence_box AS b
WHERE b.world_id IN (SELECT world_id FROM octree_cell)
    AND NOT EXISTS (SELECT 1 FROM octree_entry AS e WHERE e.world_id = b.world_id AND e.occurrence_id = b.occurrence_id)
ORDER BY world_id, occurrence_id, cell
