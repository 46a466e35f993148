-- Which placed parts, features, surfaces and arcs lie in a box: SELECT * FROM parts_in_box(x0, y0, z0, x1, y1, z1), the
-- name of a world after them where the store holds several.  Lengths in mm, in the world's frame; touching counts.
-- A body is looked at where the box around its parts meets the box asked for, and of its pages and then of its parts those
-- that reach it, as they stand.  Of what is left the boxes around the placed boxes of the shapes, and then those around the
-- placed hulls, decide.
-- EXPORT DATABASE writes macros of tables in the order of their names, and IMPORT DATABASE binds each as it comes: one
-- that others ask comes before them in the alphabet, as all_about_boxes, all_in_bounds, all_in_box and, in the next file,
-- aimed_view, all_in_bounds_of_ball and all_in_bounds_of_view do.

CREATE MACRO checked_box(x0, y0, z0, x1, y1, z1) AS
    CASE WHEN x0 <= x1 AND y0 <= y1 AND z0 <= z1 AND least(x0, y0, z0) > CAST('-infinity' AS DOUBLE)
            AND greatest(x1, y1, z1) < CAST('infinity' AS DOUBLE) THEN 1
        ELSE error('the box is inverted or not finite: give x0 y0 z0 x1 y1 z1 in mm, least first') END;
COMMENT ON MACRO checked_box IS
    '1 where a box is one, else an error; as the argument of a table function, which is worked out before all else.';

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

CREATE MACRO all_about_boxes(volume_nos, xs0, ys0, zs0, xs1, ys1, zs1, in_world := NULL) AS TABLE
WITH asked_box AS MATERIALIZED (
    SELECT unnest(volume_nos) AS volume_no, unnest(xs0) AS x0, unnest(ys0) AS y0, unnest(zs0) AS z0,
        unnest(xs1) AS x1, unnest(ys1) AS y1, unnest(zs1) AS z1
),
placed_page AS MATERIALIZED (  -- pages of the bodies as they stand, and how far about its middle each reaches
    SELECT b.object_no, b.body_no, g.page, g.object_id, b.world, b.name,
        b.m00, b.m01, b.m02, b.m03,
        b.m10, b.m11, b.m12, b.m13,
        b.m20, b.m21, b.m22, b.m23,
        reach_back(b.m00, b.m01, b.m02, b.m03, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) - 1e-6 AS x0,
        reach_back(b.m10, b.m11, b.m12, b.m13, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) - 1e-6 AS y0,
        reach_back(b.m20, b.m21, b.m22, b.m23, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) - 1e-6 AS z0,
        reach_forth(b.m00, b.m01, b.m02, b.m03, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) + 1e-6 AS x1,
        reach_forth(b.m10, b.m11, b.m12, b.m13, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) + 1e-6 AS y1,
        reach_forth(b.m20, b.m21, b.m22, b.m23, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) + 1e-6 AS z1
    FROM (
        SELECT p.world, p.name, p.object_id, b.*
        FROM placed_body AS b
        JOIN placed_object AS p ON p.object_no = b.object_no
        CROSS JOIN (
            SELECT min(x0) AS x0, min(y0) AS y0, min(z0) AS z0, max(x1) AS x1, max(y1) AS y1, max(z1) AS z1 FROM asked_box
        ) AS a
        WHERE b.last_revision IS NULL AND (in_world IS NULL OR p.world = in_world)
            AND b.x0 <= a.x1 AND b.y0 <= a.y1 AND b.z0 <= a.z1 AND b.x1 >= a.x0 AND b.y1 >= a.y0 AND b.z1 >= a.z0
    ) AS b
    JOIN object_page AS g ON g.object_id = b.object_id AND g.body_no = b.body_no
),
met_page AS MATERIALIZED (  -- made a list and taken apart again, which the planner takes for few rows: else it hashes all nodes
    SELECT unnest(m.met, recursive := TRUE)
    FROM (
        SELECT list({
                volume_no: a.volume_no, x0: a.x0, y0: a.y0, z0: a.z0, x1: a.x1, y1: a.y1, z1: a.z1,
                object_no: g.object_no, body_no: g.body_no, page: g.page
            }) AS met
        FROM asked_box AS a
        JOIN placed_page AS g ON g.x0 <= a.x1 AND g.x1 >= a.x0 AND g.y0 <= a.y1 AND g.y1 >= a.y0
            AND g.z0 <= a.z1 AND g.z1 >= a.z0
    ) AS m
),
near AS MATERIALIZED (  -- parts whose middle is within reach: their poses are worked out
    SELECT b.volume_no, b.x0 AS least_x, b.y0 AS least_y, b.z0 AS least_z,
        b.x1 AS most_x, b.y1 AS most_y, b.z1 AS most_z, b.world,
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
    FROM (
        SELECT m.volume_no, m.x0, m.y0, m.z0, m.x1, m.y1, m.z1, g.object_no, g.object_id, g.page, g.world, g.name,
            g.m00, g.m01, g.m02, g.m03,
        g.m10, g.m11, g.m12, g.m13,
        g.m20, g.m21, g.m22, g.m23
        FROM met_page AS m
        JOIN placed_page AS g ON g.object_no = m.object_no AND g.body_no = m.body_no AND g.page = m.page
    ) AS b
    JOIN (
        SELECT *, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
            (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6 AS reach
        FROM object_node
    ) AS n ON n.object_id = b.object_id AND n.page = b.page
        AND b.m00 * n.x + b.m01 * n.y + b.m02 * n.z + b.m03 BETWEEN b.x0 - n.reach AND b.x1 + n.reach
        AND b.m10 * n.x + b.m11 * n.y + b.m12 * n.z + b.m13 BETWEEN b.y0 - n.reach AND b.y1 + n.reach
        AND b.m20 * n.x + b.m21 * n.y + b.m22 * n.z + b.m23 BETWEEN b.z0 - n.reach AND b.z1 + n.reach
),
boxed AS MATERIALIZED (
    SELECT o.*, s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1,
        s.z1 AS shape_z1, s.hull_x, s.hull_y, s.hull_z, s.hull_mm,
        reach_back(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS x0,
        reach_back(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS y0,
        reach_back(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS z0,
        reach_forth(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS x1,
        reach_forth(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS y1,
        reach_forth(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS z1
    FROM near AS o
    JOIN shape AS s ON s.id = o.shape_id
),
hulled AS MATERIALIZED (
    SELECT o.volume_no, o.least_x, o.least_y, o.least_z, o.most_x, o.most_y, o.most_z, o.world, o.id, o.path,
        o.part_id, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23,
        o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1,
        CASE WHEN o.hull_mm IS NULL THEN o.x0 ELSE greatest(o.x0, hull_back(o.m00, o.m01, o.m02, o.m03, o.hull_x, o.hull_y, o.hull_z)
            - o.hull_mm) END AS x0,
        CASE WHEN o.hull_mm IS NULL THEN o.y0 ELSE greatest(o.y0, hull_back(o.m10, o.m11, o.m12, o.m13, o.hull_x, o.hull_y, o.hull_z)
            - o.hull_mm) END AS y0,
        CASE WHEN o.hull_mm IS NULL THEN o.z0 ELSE greatest(o.z0, hull_back(o.m20, o.m21, o.m22, o.m23, o.hull_x, o.hull_y, o.hull_z)
            - o.hull_mm) END AS z0,
        CASE WHEN o.hull_mm IS NULL THEN o.x1 ELSE least(o.x1, hull_forth(o.m00, o.m01, o.m02, o.m03, o.hull_x, o.hull_y, o.hull_z)
            + o.hull_mm) END AS x1,
        CASE WHEN o.hull_mm IS NULL THEN o.y1 ELSE least(o.y1, hull_forth(o.m10, o.m11, o.m12, o.m13, o.hull_x, o.hull_y, o.hull_z)
            + o.hull_mm) END AS y1,
        CASE WHEN o.hull_mm IS NULL THEN o.z1 ELSE least(o.z1, hull_forth(o.m20, o.m21, o.m22, o.m23, o.hull_x, o.hull_y, o.hull_z)
            + o.hull_mm) END AS z1
    FROM boxed AS o
    WHERE o.x0 <= o.most_x AND o.y0 <= o.most_y AND o.z0 <= o.most_z
        AND o.x1 >= o.least_x AND o.y1 >= o.least_y AND o.z1 >= o.least_z
)
SELECT o.*
FROM hulled AS o
WHERE o.x0 <= o.most_x AND o.y0 <= o.most_y AND o.z0 <= o.most_z
    AND o.x1 >= o.least_x AND o.y1 >= o.least_y AND o.z1 >= o.least_z;
COMMENT ON MACRO TABLE all_about_boxes IS
    'Placed parts whose world box meets each of the boxes given by columns, with pose and shape box; newest revision of all worlds or one.';

CREATE MACRO all_in_bounds(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT o.world, o.id, o.path, o.part_id, o.shape_id,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM all_about_boxes([0], [from_x], [from_y], [from_z], [to_x], [to_y], [to_z], in_world) AS o;
COMMENT ON MACRO TABLE all_in_bounds IS
    'Placed parts whose world box meets a box, with pose and shape box; newest revision of all worlds or one.';

CREATE MACRO parts_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM range(checked_box(from_x, from_y, from_z, to_x, to_y, to_z))
CROSS JOIN all_in_bounds(from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS o
JOIN part ON part.id = o.part_id;
COMMENT ON MACRO TABLE parts_in_box IS
    'Placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE MACRO parts_within_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT o.*
FROM parts_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS o
WHERE o.x0 >= from_x AND o.y0 >= from_y AND o.z0 >= from_z AND o.x1 <= to_x AND o.y1 <= to_y AND o.z1 <= to_z;
COMMENT ON MACRO TABLE parts_within_box IS
    'Placed parts whose world box lies wholly in a box; newest revision of all worlds or one.';

CREATE MACRO nearest_parts(at_x, at_y, at_z, how_many, in_world := NULL) AS TABLE
WITH page AS MATERIALIZED (  -- how many parts each holds, and how far from the point these are at most
    SELECT g.box_count, 1e-6 + sqrt(
            power(greatest(
                at_x - reach_back(b.m00, b.m01, b.m02, b.m03, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1),
                reach_forth(b.m00, b.m01, b.m02, b.m03, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) - at_x
            ), 2)
            + power(greatest(
                at_y - reach_back(b.m10, b.m11, b.m12, b.m13, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1),
                reach_forth(b.m10, b.m11, b.m12, b.m13, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) - at_y
            ), 2)
            + power(greatest(
                at_z - reach_back(b.m20, b.m21, b.m22, b.m23, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1),
                reach_forth(b.m20, b.m21, b.m22, b.m23, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) - at_z
            ), 2)
        ) AS reach
    FROM placed_body AS b
    JOIN placed_object AS p ON p.object_no = b.object_no
    JOIN object_page AS g ON g.object_id = p.object_id AND g.body_no = b.body_no
    WHERE b.last_revision IS NULL AND (in_world IS NULL OR p.world = in_world)
),
enough AS MATERIALIZED (  -- within which there are so many
    SELECT min(h.reach) AS reach
    FROM (SELECT reach, sum(box_count) OVER (ORDER BY reach) AS held FROM page) AS h
    WHERE h.held >= least(how_many, (SELECT sum(box_count) FROM page))
)
SELECT o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
    sqrt(power(greatest(o.x0 - at_x, at_x - o.x1, 0), 2) + power(greatest(o.y0 - at_y, at_y - o.y1, 0), 2)
        + power(greatest(o.z0 - at_z, at_z - o.z1, 0), 2)) AS distance_mm
FROM all_about_boxes(
    [0],
    [(SELECT at_x - reach FROM enough)], [(SELECT at_y - reach FROM enough)], [(SELECT at_z - reach FROM enough)],
    [(SELECT at_x + reach FROM enough)], [(SELECT at_y + reach FROM enough)], [(SELECT at_z + reach FROM enough)],
    in_world
) AS o
JOIN part ON part.id = o.part_id
ORDER BY distance_mm, occurrence_id
LIMIT how_many;
COMMENT ON MACRO TABLE nearest_parts IS
    'The parts whose world boxes are nearest to a point, so many, and how far these are, mm; newest revision of all worlds or one.';

CREATE MACRO all_in_box(in_level, from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
WITH placed AS MATERIALIZED (
    SELECT o.*
    FROM range(checked_box(from_x, from_y, from_z, to_x, to_y, to_z))
    CROSS JOIN all_in_bounds(from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS o
),
carried AS (
    SELECT o.world, o.id AS occurrence_id, o.path, o.shape_id, e.element_no,
        reach_back(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x0,
        reach_back(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y0,
        reach_back(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z0,
        reach_forth(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x1,
        reach_forth(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y1,
        reach_forth(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z1
    FROM placed AS o
    JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = in_level
)
SELECT c.world, c.occurrence_id, c.path, c.shape_id, c.element_no, c.x0, c.y0, c.z0, c.x1, c.y1, c.z1
FROM carried AS c
WHERE c.x0 <= to_x AND c.y0 <= to_y AND c.z0 <= to_z
    AND c.x1 >= from_x AND c.y1 >= from_y AND c.z1 >= from_z;
COMMENT ON MACRO TABLE all_in_box IS
    'Elements of a level of placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE MACRO features_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS feature_no, f.name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_box('feature', from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no;
COMMENT ON MACRO TABLE features_in_box IS
    'Features of placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE MACRO surfaces_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_box('surface', from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no;
COMMENT ON MACRO TABLE surfaces_in_box IS
    'Surfaces of placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE MACRO arcs_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_box('arc', from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS e;
COMMENT ON MACRO TABLE arcs_in_box IS
    'Arcs of placed parts whose world box meets a box; newest revision of all worlds or one.';
