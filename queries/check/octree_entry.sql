-- Parts that the oct-tree of their object lists nowhere, or in a cell that the cube about them does not touch, which
-- holds their world box however the object is turned.
-- Takes nothing; gives object_id, node_no and cell (null: of a part that no leaf lists).
WITH entry AS (
    SELECT object_id, cell, body_no, unnest(nodes) AS node_no
    FROM octree_cell
),
cube AS (
    SELECT object_id, node_no, body_no, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
        sqrt(3 * (power(x1 - x0, 2) + power(y1 - y0, 2) + power(z1 - z0, 2))) / 2 + 1e-6 AS half
    FROM object_node
    WHERE part_id IS NOT NULL
),
listed AS (
    SELECT e.object_id, e.node_no, e.cell
    FROM entry AS e
    JOIN octree_cell AS c ON c.object_id = e.object_id AND c.cell = e.cell
    LEFT JOIN cube AS n ON n.object_id = e.object_id AND n.node_no = e.node_no AND n.body_no = e.body_no
    WHERE n.node_no IS NULL OR n.x NOT BETWEEN c.x0 - n.half AND c.x1 + n.half
        OR n.y NOT BETWEEN c.y0 - n.half AND c.y1 + n.half OR n.z NOT BETWEEN c.z0 - n.half AND c.z1 + n.half
)
SELECT object_id, node_no, cell FROM listed
UNION ALL
SELECT n.object_id, n.node_no, NULL
FROM object_node AS n
WHERE n.part_id IS NOT NULL AND n.object_id IN (SELECT object_id FROM octree_cell)
    AND NOT EXISTS (SELECT 1 FROM entry AS e WHERE e.object_id = n.object_id AND e.node_no = n.node_no)
ORDER BY object_id, node_no, cell
