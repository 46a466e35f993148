-- As find_elements_in_boxes, by a walk down the oct-tree of a world whose oct-tree was written.
-- Takes volume_no, x0, y0, z0, x1, y1, z1 (arrays of one length: the boxes, mm, world), world_id and level.
-- Gives volume_no, occurrence_id, shape_id, element_no, path of the part, name, the world box x0 .. z1, the box in the
-- shape's frame shape_x0 .. shape_z1 and world_from_occurrence m00 .. m23, sorted by volume_no, occurrence_id,
-- element_no.
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
placed AS MATERIALIZED (
    SELECT a.volume_no, o.id, o.path, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23
    FROM near AS n
    JOIN asked AS a ON a.volume_no = n.volume_no
    JOIN occurrence AS o ON o.id = n.occurrence_id
        AND o.x0 <= a.x1 AND o.y0 <= a.y1 AND o.z0 <= a.z1
        AND o.x1 >= a.x0 AND o.y1 >= a.y0 AND o.z1 >= a.z0
),
carried AS (
    SELECT o.*, e.element_no, e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0,
        e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        least(o.m00 * e.x0, o.m00 * e.x1) + least(o.m01 * e.y0, o.m01 * e.y1)
            + least(o.m02 * e.z0, o.m02 * e.z1) + o.m03 AS x0,
        least(o.m10 * e.x0, o.m10 * e.x1) + least(o.m11 * e.y0, o.m11 * e.y1)
            + least(o.m12 * e.z0, o.m12 * e.z1) + o.m13 AS y0,
        least(o.m20 * e.x0, o.m20 * e.x1) + least(o.m21 * e.y0, o.m21 * e.y1)
            + least(o.m22 * e.z0, o.m22 * e.z1) + o.m23 AS z0,
        greatest(o.m00 * e.x0, o.m00 * e.x1) + greatest(o.m01 * e.y0, o.m01 * e.y1)
            + greatest(o.m02 * e.z0, o.m02 * e.z1) + o.m03 AS x1,
        greatest(o.m10 * e.x0, o.m10 * e.x1) + greatest(o.m11 * e.y0, o.m11 * e.y1)
            + greatest(o.m12 * e.z0, o.m12 * e.z1) + o.m13 AS y1,
        greatest(o.m20 * e.x0, o.m20 * e.x1) + greatest(o.m21 * e.y0, o.m21 * e.y1)
            + greatest(o.m22 * e.z0, o.m22 * e.z1) + o.m23 AS z1
    FROM placed AS o
    JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = :level
)
SELECT o.volume_no, o.id AS occurrence_id, o.shape_id, o.element_no, o.path,
    coalesce(f.name, s.name, CAST(:level AS TEXT) || ' ' || CAST(o.element_no AS TEXT)) AS name,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM carried AS o
JOIN asked AS a ON a.volume_no = o.volume_no
LEFT JOIN feature AS f ON f.shape_id = o.shape_id AND f.feature_no = o.element_no AND CAST(:level AS TEXT) = 'feature'
LEFT JOIN shape_surface AS s
    ON s.shape_id = o.shape_id AND s.surface_no = o.element_no AND CAST(:level AS TEXT) = 'surface'
WHERE o.x0 <= a.x1 AND o.y0 <= a.y1 AND o.z0 <= a.z1
    AND o.x1 >= a.x0 AND o.y1 >= a.y0 AND o.z1 >= a.z0
ORDER BY o.volume_no, o.id, o.element_no
