-- As find_parts_in_boxes, by a walk down the oct-tree of a world whose oct-tree was written.
-- Takes volume_no, x0, y0, z0, x1, y1, z1 (arrays of one length: the boxes, mm, world) and world_id.
-- Gives volume_no, occurrence_id, shape_id, element_no (-1), path, name, the world box x0 .. z1, the box of the shape in
-- its own frame shape_x0 .. shape_z1 and world_from_occurrence m00 .. m23, sorted by volume_no, occurrence_id.
WITH RECURSIVE asked AS MATERIALIZED (
    SELECT unnest(CAST(:volume_no AS INTEGER[])) AS volume_no,
        unnest(CAST(:x0 AS DOUBLE PRECISION[])) AS x0, unnest(CAST(:y0 AS DOUBLE PRECISION[])) AS y0,
        unnest(CAST(:z0 AS DOUBLE PRECISION[])) AS z0, unnest(CAST(:x1 AS DOUBLE PRECISION[])) AS x1,
        unnest(CAST(:y1 AS DOUBLE PRECISION[])) AS y1, unnest(CAST(:z1 AS DOUBLE PRECISION[])) AS z1
),
walk (volume_no, cell) AS (
    SELECT a.volume_no, c.cell
    FROM asked AS a
    JOIN octree_cell AS c ON c.world_id = :world_id AND c.parent IS NULL
        AND c.x0 <= a.x1 AND c.y0 <= a.y1 AND c.z0 <= a.z1
        AND c.x1 >= a.x0 AND c.y1 >= a.y0 AND c.z1 >= a.z0
    UNION ALL
    SELECT a.volume_no, c.cell
    FROM walk AS w
    JOIN asked AS a ON a.volume_no = w.volume_no
    JOIN octree_cell AS c ON c.world_id = :world_id AND c.parent = w.cell
        AND c.x0 <= a.x1 AND c.y0 <= a.y1 AND c.z0 <= a.z1
        AND c.x1 >= a.x0 AND c.y1 >= a.y0 AND c.z1 >= a.z0
),
near AS MATERIALIZED (
    SELECT DISTINCT w.volume_no, e.occurrence_id
    FROM walk AS w
    JOIN octree_entry AS e ON e.world_id = :world_id AND e.cell = w.cell
),
met AS MATERIALIZED (
    SELECT a.volume_no, o.id, o.shape_id, o.part_id, o.path,
        o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23
    FROM near AS n
    JOIN asked AS a ON a.volume_no = n.volume_no
    JOIN occurrence AS o ON o.id = n.occurrence_id
        AND o.x0 <= a.x1 AND o.y0 <= a.y1 AND o.z0 <= a.z1
        AND o.x1 >= a.x0 AND o.y1 >= a.y0 AND o.z1 >= a.z0
)
SELECT o.volume_no, o.id AS occurrence_id, o.shape_id, -1 AS element_no, o.path, part.name,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
    s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM met AS o
JOIN part ON part.id = o.part_id
JOIN shape AS s ON s.id = o.shape_id
ORDER BY o.volume_no, o.id
