-- As find/in_boxes, by a walk down the oct-trees of its objects, where these were written.
-- Takes volume_no, x0, y0, z0, x1, y1, z1 (arrays of one length: the boxes, mm, world), world_id and level (part,
-- feature, surface or arc); gives volume_no, occurrence_id, shape_id, element_no (-1 of parts), path of the part, name,
-- the world box x0 .. z1, the box in the shape's frame shape_x0 .. shape_z1 and world_from_occurrence m00 .. m23,
-- sorted by volume_no, occurrence_id, element_no.
WITH RECURSIVE asked AS MATERIALIZED (
    SELECT unnest(CAST(:volume_no AS INTEGER[])) AS volume_no,
        unnest(CAST(:x0 AS DOUBLE PRECISION[])) AS x0, unnest(CAST(:y0 AS DOUBLE PRECISION[])) AS y0,
        unnest(CAST(:z0 AS DOUBLE PRECISION[])) AS z0, unnest(CAST(:x1 AS DOUBLE PRECISION[])) AS x1,
        unnest(CAST(:y1 AS DOUBLE PRECISION[])) AS y1, unnest(CAST(:z1 AS DOUBLE PRECISION[])) AS z1
),
near AS MATERIALIZED (  -- bodies that the boxes may meet
    SELECT a.volume_no, a.x0, a.y0, a.z0, a.x1, a.y1, a.z1, p.name, p.object_no, p.object_id, b.body_no,
        b.m00, b.m01, b.m02, b.m03,
        b.m10, b.m11, b.m12, b.m13,
        b.m20, b.m21, b.m22, b.m23
    FROM asked AS a
    JOIN placed_body AS b ON b.x0 <= a.x1 AND b.y0 <= a.y1 AND b.z0 <= a.z1
        AND b.x1 >= a.x0 AND b.y1 >= a.y0 AND b.z1 >= a.z0
    JOIN placed_object AS p ON p.object_no = b.object_no
    JOIN world AS w ON w.name = p.world AND w.revision BETWEEN b.first_revision AND coalesce(b.last_revision, w.revision)
    WHERE w.id = :world_id
),
walk (volume_no, object_no, object_id, body_no, cell, nodes) AS (
    SELECT b.volume_no, b.object_no, b.object_id, b.body_no, c.cell, c.nodes
    FROM near AS b
    JOIN octree_cell AS c ON c.object_id = b.object_id AND c.body_no = b.body_no AND c.parent IS NULL
    UNION ALL
    SELECT w.volume_no, w.object_no, w.object_id, w.body_no, c.cell, c.nodes
    FROM walk AS w
    JOIN near AS b ON b.volume_no = w.volume_no AND b.object_no = w.object_no AND b.body_no = w.body_no
    JOIN (
        SELECT object_id, parent, cell, nodes, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
            (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6 AS reach
        FROM octree_cell
    ) AS c ON c.object_id = w.object_id AND c.parent = w.cell
        AND b.m00 * c.x + b.m01 * c.y + b.m02 * c.z + b.m03 BETWEEN b.x0 - c.reach AND b.x1 + c.reach
        AND b.m10 * c.x + b.m11 * c.y + b.m12 * c.z + b.m13 BETWEEN b.y0 - c.reach AND b.y1 + c.reach
        AND b.m20 * c.x + b.m21 * c.y + b.m22 * c.z + b.m23 BETWEEN b.z0 - c.reach AND b.z1 + c.reach
),
listed AS MATERIALIZED (
    SELECT DISTINCT w.volume_no, w.object_no, w.object_id, w.body_no, unnest(w.nodes) AS node_no
    FROM walk AS w
),
posed AS MATERIALIZED (
    SELECT b.volume_no, b.x0 AS least_x, b.y0 AS least_y, b.z0 AS least_z,
        b.x1 AS most_x, b.y1 AS most_y, b.z1 AS most_z,
        CAST(b.object_no AS BIGINT) * 268435456 + n.node_no AS id, b.name || n.path AS path, n.part_id, n.shape_id,
        b.m00 * n.m00 + b.m01 * n.m10 + b.m02 * n.m20 AS m00,
        b.m00 * n.m01 + b.m01 * n.m11 + b.m02 * n.m21 AS m01,
        b.m00 * n.m02 + b.m01 * n.m12 + b.m02 * n.m22 AS m02,
        b.m00 * n.m03 + b.m01 * n.m13 + b.m02 * n.m23 + b.m03 AS m03,
        b.m10 * n.m00 + b.m11 * n.m10 + b.m12 * n.m20 AS m10,
        b.m10 * n.m01 + b.m11 * n.m11 + b.m12 * n.m21 AS m11,
        b.m10 * n.m02 + b.m11 * n.m12 + b.m12 * n.m22 AS m12,
        b.m10 * n.m03 + b.m11 * n.m13 + b.m12 * n.m23 + b.m13 AS m13,
        b.m20 * n.m00 + b.m21 * n.m10 + b.m22 * n.m20 AS m20,
        b.m20 * n.m01 + b.m21 * n.m11 + b.m22 * n.m21 AS m21,
        b.m20 * n.m02 + b.m21 * n.m12 + b.m22 * n.m22 AS m22,
        b.m20 * n.m03 + b.m21 * n.m13 + b.m22 * n.m23 + b.m23 AS m23
    FROM listed AS l
    JOIN near AS b ON b.volume_no = l.volume_no AND b.object_no = l.object_no AND b.body_no = l.body_no
    JOIN (
        SELECT *, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
            (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6 AS reach
        FROM object_node
    ) AS n ON n.object_id = l.object_id AND n.node_no = l.node_no
        AND b.m00 * n.x + b.m01 * n.y + b.m02 * n.z + b.m03 BETWEEN b.x0 - n.reach AND b.x1 + n.reach
        AND b.m10 * n.x + b.m11 * n.y + b.m12 * n.z + b.m13 BETWEEN b.y0 - n.reach AND b.y1 + n.reach
        AND b.m20 * n.x + b.m21 * n.y + b.m22 * n.z + b.m23 BETWEEN b.z0 - n.reach AND b.z1 + n.reach
),
met AS MATERIALIZED (  -- by the boxes around the placed boxes of the shapes and around the placed hulls
    SELECT o.*
    FROM (
        SELECT o.*, s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
            greatest(reach_back(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1),
                hull_back(o.m00, o.m01, o.m02, o.m03, s.hull_x, s.hull_y, s.hull_z) - s.hull_mm) AS x0,
            greatest(reach_back(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1),
                hull_back(o.m10, o.m11, o.m12, o.m13, s.hull_x, s.hull_y, s.hull_z) - s.hull_mm) AS y0,
            greatest(reach_back(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1),
                hull_back(o.m20, o.m21, o.m22, o.m23, s.hull_x, s.hull_y, s.hull_z) - s.hull_mm) AS z0,
            least(reach_forth(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1),
                hull_forth(o.m00, o.m01, o.m02, o.m03, s.hull_x, s.hull_y, s.hull_z) + s.hull_mm) AS x1,
            least(reach_forth(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1),
                hull_forth(o.m10, o.m11, o.m12, o.m13, s.hull_x, s.hull_y, s.hull_z) + s.hull_mm) AS y1,
            least(reach_forth(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1),
                hull_forth(o.m20, o.m21, o.m22, o.m23, s.hull_x, s.hull_y, s.hull_z) + s.hull_mm) AS z1
        FROM posed AS o
        JOIN shape AS s ON s.id = o.shape_id
    ) AS o
    WHERE o.x0 <= o.most_x AND o.y0 <= o.most_y AND o.z0 <= o.most_z
        AND o.x1 >= o.least_x AND o.y1 >= o.least_y AND o.z1 >= o.least_z
),
carried AS (
    SELECT o.volume_no, o.least_x, o.least_y, o.least_z, o.most_x, o.most_y, o.most_z, o.id, o.path, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23,
        e.element_no, e.name, e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0, e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        reach_back(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x0,
        reach_back(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y0,
        reach_back(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z0,
        reach_forth(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x1,
        reach_forth(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y1,
        reach_forth(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z1
    FROM met AS o
    JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = :level
    WHERE CAST(:level AS TEXT) <> 'part'
    UNION ALL
    SELECT o.volume_no, o.least_x, o.least_y, o.least_z, o.most_x, o.most_y, o.most_z, o.id, o.path, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23,
        -1, p.name, o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1,
        o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
    FROM met AS o
    JOIN part AS p ON p.id = o.part_id
    WHERE CAST(:level AS TEXT) = 'part'
)
SELECT o.volume_no, o.id AS occurrence_id, o.shape_id, o.element_no, o.path, o.name,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM carried AS o
WHERE o.x0 <= o.most_x AND o.y0 <= o.most_y AND o.z0 <= o.most_z
    AND o.x1 >= o.least_x AND o.y1 >= o.least_y AND o.z1 >= o.least_z
ORDER BY o.volume_no, o.id, o.element_no
