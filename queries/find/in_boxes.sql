-- Placed parts, or their features, surfaces or arcs, whose world box meets any of some boxes, touching counts.
-- Takes volume_no, x0, y0, z0, x1, y1, z1 (arrays of one length: the boxes, mm, world), world (its name) and level (part,
-- feature, surface or arc); gives volume_no, occurrence_id, shape_id, element_no (-1 of parts), path of the part, name,
-- the world box x0 .. z1, the box in the shape's frame shape_x0 .. shape_z1 and world_from_occurrence m00 .. m23,
-- sorted by volume_no, occurrence_id, element_no.
WITH met AS MATERIALIZED (
    SELECT *
    FROM all_about_boxes(
        CAST(:volume_no AS INTEGER[]), CAST(:x0 AS DOUBLE PRECISION[]), CAST(:y0 AS DOUBLE PRECISION[]),
        CAST(:z0 AS DOUBLE PRECISION[]), CAST(:x1 AS DOUBLE PRECISION[]), CAST(:y1 AS DOUBLE PRECISION[]),
        CAST(:z1 AS DOUBLE PRECISION[]), CAST(:world AS TEXT)
    )
),
carried AS (
    SELECT o.volume_no, o.least_x, o.least_y, o.least_z, o.most_x, o.most_y, o.most_z, o.id, o.path, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23,
        e.element_no, coalesce(f.name, s.name, CAST(:level AS TEXT) || ' ' || CAST(e.element_no AS TEXT)) AS name,
        e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0, e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        reach_back(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x0,
        reach_back(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y0,
        reach_back(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z0,
        reach_forth(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x1,
        reach_forth(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y1,
        reach_forth(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z1
    FROM met AS o
    JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = :level
    LEFT JOIN feature AS f
        ON f.shape_id = e.shape_id AND f.feature_no = e.element_no AND CAST(:level AS TEXT) = 'feature'
    LEFT JOIN shape_surface AS s
        ON s.shape_id = e.shape_id AND s.surface_no = e.element_no AND CAST(:level AS TEXT) = 'surface'
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
