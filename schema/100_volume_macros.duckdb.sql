-- Which placed parts, features, surfaces and arcs lie in a box: SELECT * FROM parts_in_box(x0, y0, z0, x1, y1, z1), the
-- name of a world after them where the store holds several.  Lengths in mm, in the world's frame; touching counts.
-- A body is looked at where the box around its parts meets the box asked for, and of its pages and then of its parts those
-- that reach it, as they stand.  Of what is left the boxes around the placed boxes of the shapes, and then those around the
-- placed hulls, decide.
-- EXPORT DATABASE writes macros of tables in the order of their names, and IMPORT DATABASE binds each as it comes: one
-- that others ask comes before them in the alphabet, as all that begin with all_ do.

CREATE MACRO checked_box(x0, y0, z0, x1, y1, z1) AS
    CASE WHEN x0 <= x1 AND y0 <= y1 AND z0 <= z1 AND least(x0, y0, z0) > CAST('-infinity' AS DOUBLE)
            AND greatest(x1, y1, z1) < CAST('infinity' AS DOUBLE) THEN 0
        ELSE error('the box is inverted or not finite: give x0 y0 z0 x1 y1 z1 in mm, least first') END;
COMMENT ON MACRO checked_box IS
    '0 where a box is one, else an error.';

CREATE MACRO reach_back(nx, ny, nz, shift, x0, y0, z0, x1, y1, z1) AS
    least(nx * x0, nx * x1) + least(ny * y0, ny * y1) + least(nz * z0, nz * z1) + shift;
COMMENT ON MACRO reach_back IS
    'The least n . p + shift of the points p of a box.';

CREATE MACRO reach_forth(nx, ny, nz, shift, x0, y0, z0, x1, y1, z1) AS
    greatest(nx * x0, nx * x1) + greatest(ny * y0, ny * y1) + greatest(nz * z0, nz * z1) + shift;
COMMENT ON MACRO reach_forth IS
    'The greatest n . p + shift of the points p of a box.';

CREATE MACRO hull_back(nx, ny, nz, shift, xs, ys, zs) AS
    list_min(list_transform(xs, (x, i) -> nx * x + ny * ys[i] + nz * zs[i])) + shift;
COMMENT ON MACRO hull_back IS
    'The least n . p + shift of the corners p of a hull; null of none.';

CREATE MACRO hull_forth(nx, ny, nz, shift, xs, ys, zs) AS
    list_max(list_transform(xs, (x, i) -> nx * x + ny * ys[i] + nz * zs[i])) + shift;
COMMENT ON MACRO hull_forth IS
    'The greatest n . p + shift of the corners p of a hull; null of none.';

CREATE MACRO all_about(asked, in_world) AS TABLE
WITH asked_box AS MATERIALIZED (
    SELECT q.volume_no, CAST(q.x0 AS DOUBLE) AS least_x, CAST(q.y0 AS DOUBLE) AS least_y, CAST(q.z0 AS DOUBLE) AS least_z,
        CAST(q.x1 AS DOUBLE) AS most_x, CAST(q.y1 AS DOUBLE) AS most_y, CAST(q.z1 AS DOUBLE) AS most_z
    FROM (SELECT unnest(asked, recursive := TRUE)) AS q
),
placed_page AS MATERIALIZED (  -- pages of the bodies as they stand, and how far about its middle each reaches
    SELECT b.*, g.page,
        b.m00 * g.x + b.m01 * g.y + b.m02 * g.z + b.m03 AS x, abs(b.m00) * g.rx + abs(b.m01) * g.ry + abs(b.m02) * g.rz + 1e-6 AS rx,
        b.m10 * g.x + b.m11 * g.y + b.m12 * g.z + b.m13 AS y, abs(b.m10) * g.rx + abs(b.m11) * g.ry + abs(b.m12) * g.rz + 1e-6 AS ry,
        b.m20 * g.x + b.m21 * g.y + b.m22 * g.z + b.m23 AS z, abs(b.m20) * g.rx + abs(b.m21) * g.ry + abs(b.m22) * g.rz + 1e-6 AS rz
    FROM (
        SELECT p.world, p.name, p.object_id, b.object_no, b.body_no,
            b.m00, b.m01, b.m02, b.m03, b.m10, b.m11, b.m12, b.m13, b.m20, b.m21, b.m22, b.m23
        FROM placed_body AS b
        JOIN placed_object AS p ON p.object_no = b.object_no
        CROSS JOIN (
            SELECT min(least_x) AS x0, min(least_y) AS y0, min(least_z) AS z0, max(most_x) AS x1, max(most_y) AS y1, max(most_z) AS z1
            FROM asked_box
        ) AS a
        WHERE b.last_revision IS NULL AND (in_world IS NULL OR p.world = in_world)
            AND b.x0 <= a.x1 AND b.y0 <= a.y1 AND b.z0 <= a.z1 AND b.x1 >= a.x0 AND b.y1 >= a.y0 AND b.z1 >= a.z0
    ) AS b
    JOIN (
        SELECT object_id, page, body_no, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
            (x1 - x0) / 2 AS rx, (y1 - y0) / 2 AS ry, (z1 - z0) / 2 AS rz
        FROM object_page
    ) AS g ON g.object_id = b.object_id AND g.body_no = b.body_no
),
met_page AS MATERIALIZED (  -- made a list and taken apart again, which the planner takes for few rows: else it hashes all nodes
    SELECT unnest(m.met, recursive := TRUE)
    FROM (
        SELECT list({asked: a, page: g}) AS met
        FROM asked_box AS a
        JOIN placed_page AS g ON g.x - g.rx <= a.most_x AND g.x + g.rx >= a.least_x AND g.y - g.ry <= a.most_y AND g.y + g.ry >= a.least_y
            AND g.z - g.rz <= a.most_z AND g.z + g.rz >= a.least_z
    ) AS m
),
near AS NOT MATERIALIZED (  -- parts whose middle is within reach: their poses are worked out
    SELECT b.volume_no, b.least_x, b.least_y, b.least_z, b.most_x, b.most_y, b.most_z, b.world,
        CAST(b.object_no AS BIGINT) * 268435456 + n.node_no AS occurrence_id, b.name || n.path AS path, n.part_id, n.shape_id,
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
    FROM met_page AS b
    JOIN (
        SELECT *, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
            (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6 AS reach
        FROM object_node
    ) AS n ON n.object_id = b.object_id AND n.page = b.page
        AND b.m00 * n.x + b.m01 * n.y + b.m02 * n.z + b.m03 BETWEEN b.least_x - n.reach AND b.most_x + n.reach
        AND b.m10 * n.x + b.m11 * n.y + b.m12 * n.z + b.m13 BETWEEN b.least_y - n.reach AND b.most_y + n.reach
        AND b.m20 * n.x + b.m21 * n.y + b.m22 * n.z + b.m23 BETWEEN b.least_z - n.reach AND b.most_z + n.reach
),
met AS MATERIALIZED (  -- by the boxes around the placed boxes of the shapes and around the placed hulls
    SELECT o.* EXCLUDE (hull_mm, xs, ys, zs, back_x, back_y, back_z, forth_x, forth_y, forth_z),
        greatest(back_x, list_min(xs) + m03 - hull_mm) AS x0, greatest(back_y, list_min(ys) + m13 - hull_mm) AS y0,
        greatest(back_z, list_min(zs) + m23 - hull_mm) AS z0,
        least(forth_x, list_max(xs) + m03 + hull_mm) AS x1, least(forth_y, list_max(ys) + m13 + hull_mm) AS y1,
        least(forth_z, list_max(zs) + m23 + hull_mm) AS z1
    FROM (
        SELECT o.*, s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
            s.hull_mm,
            list_transform(s.hull_x, (x, i) -> o.m00 * x + o.m01 * s.hull_y[i] + o.m02 * s.hull_z[i]) AS xs,
            list_transform(s.hull_x, (x, i) -> o.m10 * x + o.m11 * s.hull_y[i] + o.m12 * s.hull_z[i]) AS ys,
            list_transform(s.hull_x, (x, i) -> o.m20 * x + o.m21 * s.hull_y[i] + o.m22 * s.hull_z[i]) AS zs,
            reach_back(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS back_x,
            reach_back(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS back_y,
            reach_back(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS back_z,
            reach_forth(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS forth_x,
            reach_forth(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS forth_y,
            reach_forth(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS forth_z
        FROM near AS o
        JOIN shape AS s ON s.id = o.shape_id
    ) AS o
    WHERE x0 <= o.most_x AND y0 <= o.most_y AND z0 <= o.most_z AND x1 >= o.least_x AND y1 >= o.least_y AND z1 >= o.least_z
)
SELECT o.*, p.name
FROM met AS o
JOIN part AS p ON p.id = o.part_id;
COMMENT ON MACRO TABLE all_about IS
    'Placed parts whose world boxes meet each of a list of boxes; newest revision of all worlds or one.';

CREATE MACRO all_about_at(in_level, asked, in_world) AS TABLE
WITH met AS MATERIALIZED (
    SELECT o.* EXCLUDE (part_id), o.x0 AS part_x0, o.y0 AS part_y0, o.z0 AS part_z0, o.x1 AS part_x1, o.y1 AS part_y1, o.z1 AS part_z1
    FROM all_about(asked, in_world) AS o
)
SELECT o.*, -1 AS element_no
FROM met AS o
WHERE in_level = 'part'
UNION ALL BY NAME
SELECT o.*
FROM (
    SELECT o.* EXCLUDE (name, shape_x0, shape_y0, shape_z0, shape_x1, shape_y1, shape_z1, x0, y0, z0, x1, y1, z1),
        e.element_no, e.name,
        e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0, e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        reach_back(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x0,
        reach_back(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y0,
        reach_back(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z0,
        reach_forth(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x1,
        reach_forth(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y1,
        reach_forth(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z1
    FROM met AS o
    JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = in_level
) AS o
WHERE o.x0 <= o.most_x AND o.y0 <= o.most_y AND o.z0 <= o.most_z
    AND o.x1 >= o.least_x AND o.y1 >= o.least_y AND o.z1 >= o.least_z;
COMMENT ON MACRO TABLE all_about_at IS
    'The same, or the elements of a level of these parts whose world boxes meet the boxes.';

CREATE MACRO all_about_boxes(in_level, volume_nos, xs0, ys0, zs0, xs1, ys1, zs1, in_world) AS TABLE
SELECT *
FROM all_about_at(
    in_level,
    list_transform(volume_nos, (n, i) -> {volume_no: n, x0: xs0[i], y0: ys0[i], z0: zs0[i], x1: xs1[i], y1: ys1[i], z1: zs1[i]}),
    in_world
);
COMMENT ON MACRO TABLE all_about_boxes IS
    'The same of boxes given by columns.';

CREATE MACRO all_in_box(in_level, from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS TABLE
SELECT *
FROM all_about_at(
    in_level,
    [{volume_no: checked_box(from_x, from_y, from_z, to_x, to_y, to_z), x0: from_x, y0: from_y, z0: from_z, x1: to_x, y1: to_y, z1: to_z}],
    in_world
);
COMMENT ON MACRO TABLE all_in_box IS
    'The same of one box.';

CREATE MACRO all_nearest(in_level, at_x, at_y, at_z, how_many, in_world) AS TABLE
WITH page AS MATERIALIZED (  -- how many parts each holds, how many are in nearer ones, and how far from the point these are at most
    SELECT g.*, sum(g.box_count) OVER (ORDER BY g.reach) - g.box_count AS nearer
    FROM (
        SELECT b.object_no, g.object_id, g.page, g.box_count, 1e-6 + sqrt(
            power(abs(b.m00 * g.x + b.m01 * g.y + b.m02 * g.z + b.m03 - at_x) + abs(b.m00) * g.rx + abs(b.m01) * g.ry + abs(b.m02) * g.rz, 2)
            + power(abs(b.m10 * g.x + b.m11 * g.y + b.m12 * g.z + b.m13 - at_y) + abs(b.m10) * g.rx + abs(b.m11) * g.ry + abs(b.m12) * g.rz, 2)
            + power(abs(b.m20 * g.x + b.m21 * g.y + b.m22 * g.z + b.m23 - at_z) + abs(b.m20) * g.rx + abs(b.m21) * g.ry + abs(b.m22) * g.rz, 2)
        ) AS reach
        FROM placed_body AS b
        JOIN placed_object AS p ON p.object_no = b.object_no
        JOIN (
            SELECT *, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
                (x1 - x0) / 2 AS rx, (y1 - y0) / 2 AS ry, (z1 - z0) / 2 AS rz
            FROM object_page
        ) AS g ON g.object_id = p.object_id AND g.body_no = b.body_no
        WHERE b.last_revision IS NULL AND (in_world IS NULL OR p.world = in_world)
    ) AS g
),
element_count AS MATERIALIZED (  -- of pages enough for most questions: if these hold too few, all are asked
    SELECT g.object_no, g.page, count(*) AS elements
    FROM page AS g
    JOIN object_node AS n ON n.object_id = g.object_id AND n.page = g.page
    JOIN shape_box AS e ON e.shape_id = n.shape_id AND e.level = in_level
    WHERE g.nearer < CAST(how_many AS DOUBLE PRECISION) * 16 + 1000
    GROUP BY g.object_no, g.page
),
enough AS MATERIALIZED (  -- within which there are so many
    SELECT coalesce(min(h.reach) FILTER (WHERE h.held >= how_many), max(h.reach)) AS reach
    FROM (
        SELECT g.reach,
            sum(CASE WHEN in_level = 'part' THEN g.box_count ELSE coalesce(c.elements, 0) END) OVER (ORDER BY g.reach) AS held
        FROM page AS g
        LEFT JOIN element_count AS c ON c.object_no = g.object_no AND c.page = g.page
    ) AS h
)
SELECT o.*, sqrt(
        power(greatest(o.x0 - at_x, at_x - o.x1, o.part_x0 - at_x, at_x - o.part_x1, 0), 2)
        + power(greatest(o.y0 - at_y, at_y - o.y1, o.part_y0 - at_y, at_y - o.part_y1, 0), 2)
        + power(greatest(o.z0 - at_z, at_z - o.z1, o.part_z0 - at_z, at_z - o.part_z1, 0), 2)
    ) AS distance_mm
FROM all_about_at(
    in_level,
    (SELECT list({
        volume_no: 0, x0: at_x - reach, y0: at_y - reach, z0: at_z - reach, x1: at_x + reach, y1: at_y + reach, z1: at_z + reach
    }) FROM enough),
    in_world
) AS o
ORDER BY distance_mm, o.occurrence_id, o.element_no
LIMIT how_many;
COMMENT ON MACRO TABLE all_nearest IS
    'The placed parts, or their elements of a level, nearest to a point, so many, and how far their boxes in their parts'' boxes are, mm.';
