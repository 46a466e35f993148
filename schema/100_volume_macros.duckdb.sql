-- Which placed parts, features, surfaces and arcs lie in a box: SELECT * FROM parts_in_box(x0, y0, z0, x1, y1, z1), the
-- name of a world after them where the store holds several.  Lengths in mm, in the world's frame; touching counts.
-- A body is looked at where the box around its parts meets the box asked for, and of its pages those whose middle, carried
-- into the world, is within reach of that box: a page and all in it lie in a ball about its middle.  The boxes around the
-- placed boxes of shapes come next, and of what these let through those around the placed hulls decide.  Products of rows and columns are written as inner products: DuckDB takes longer to plan a question than
-- to answer it, by the number of its operations.  The arrays are made of what the pages let through, for they cost more.
-- EXPORT DATABASE writes macros of tables in the order of their names, and IMPORT DATABASE binds each as it comes: one
-- that others ask comes before them in the alphabet, as all_in_bounds, all_in_box and, in the next file, aimed_view,
-- all_in_bounds_of_ball and all_in_bounds_of_view do.

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

CREATE MACRO all_in_bounds(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT h.*
FROM (
    SELECT o.* EXCLUDE (hull_x, hull_y, hull_z, hull_mm, x0, y0, z0, x1, y1, z1),
        greatest(o.x0, hull_back(o.m00, o.m01, o.m02, o.m03, o.hull_x, o.hull_y, o.hull_z)
            - o.hull_mm) AS x0,
        greatest(o.y0, hull_back(o.m10, o.m11, o.m12, o.m13, o.hull_x, o.hull_y, o.hull_z)
            - o.hull_mm) AS y0,
        greatest(o.z0, hull_back(o.m20, o.m21, o.m22, o.m23, o.hull_x, o.hull_y, o.hull_z)
            - o.hull_mm) AS z0,
        least(o.x1, hull_forth(o.m00, o.m01, o.m02, o.m03, o.hull_x, o.hull_y, o.hull_z)
            + o.hull_mm) AS x1,
        least(o.y1, hull_forth(o.m10, o.m11, o.m12, o.m13, o.hull_x, o.hull_y, o.hull_z)
            + o.hull_mm) AS y1,
        least(o.z1, hull_forth(o.m20, o.m21, o.m22, o.m23, o.hull_x, o.hull_y, o.hull_z)
            + o.hull_mm) AS z1
    FROM (
        SELECT c.*,
            reach_back(c.m00, c.m01, c.m02, c.m03, c.shape_x0, c.shape_y0, c.shape_z0, c.shape_x1, c.shape_y1, c.shape_z1) AS x0,
            reach_back(c.m10, c.m11, c.m12, c.m13, c.shape_x0, c.shape_y0, c.shape_z0, c.shape_x1, c.shape_y1, c.shape_z1) AS y0,
            reach_back(c.m20, c.m21, c.m22, c.m23, c.shape_x0, c.shape_y0, c.shape_z0, c.shape_x1, c.shape_y1, c.shape_z1) AS z0,
            reach_forth(c.m00, c.m01, c.m02, c.m03, c.shape_x0, c.shape_y0, c.shape_z0, c.shape_x1, c.shape_y1, c.shape_z1) AS x1,
            reach_forth(c.m10, c.m11, c.m12, c.m13, c.shape_x0, c.shape_y0, c.shape_z0, c.shape_x1, c.shape_y1, c.shape_z1) AS y1,
            reach_forth(c.m20, c.m21, c.m22, c.m23, c.shape_x0, c.shape_y0, c.shape_z0, c.shape_x1, c.shape_y1, c.shape_z1) AS z1
        FROM (
            SELECT n.world, n.id, n.path, n.part_id, n.shape_id,
                n.shape_x0, n.shape_y0, n.shape_z0, n.shape_x1, n.shape_y1, n.shape_z1,
                n.hull_x, n.hull_y, n.hull_z, n.hull_mm,
                array_inner_product(n.row_0, n.column_0) AS m00,
                array_inner_product(n.row_0, n.column_1) AS m01,
                array_inner_product(n.row_0, n.column_2) AS m02,
                array_inner_product(n.row_0, n.column_3) + n.m03 AS m03,
                array_inner_product(n.row_1, n.column_0) AS m10,
                array_inner_product(n.row_1, n.column_1) AS m11,
                array_inner_product(n.row_1, n.column_2) AS m12,
                array_inner_product(n.row_1, n.column_3) + n.m13 AS m13,
                array_inner_product(n.row_2, n.column_0) AS m20,
                array_inner_product(n.row_2, n.column_1) AS m21,
                array_inner_product(n.row_2, n.column_2) AS m22,
                array_inner_product(n.row_2, n.column_3) + n.m23 AS m23
            FROM (
                SELECT b.world, CAST(b.object_no AS BIGINT) * 268435456 + n.node_no AS id, b.name || n.path AS path, n.part_id,
                    n.shape_id, b.row_0, b.row_1, b.row_2, b.m03, b.m13, b.m23,
                    array_value(n.m00, n.m10, n.m20) AS column_0, array_value(n.m01, n.m11, n.m21) AS column_1,
                    array_value(n.m02, n.m12, n.m22) AS column_2, array_value(n.m03, n.m13, n.m23) AS column_3,
                    s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
                    s.hull_x, s.hull_y, s.hull_z, s.hull_mm
                FROM (
                    SELECT p.world, p.name, p.object_no, p.object_id, b.body_no, b.m03, b.m13, b.m23,
                        array_value(b.m00, b.m01, b.m02) AS row_0, array_value(b.m10, b.m11, b.m12) AS row_1,
                        array_value(b.m20, b.m21, b.m22) AS row_2
                    FROM placed_body AS b
                    JOIN placed_object AS p ON p.object_no = b.object_no
                    WHERE b.last_revision IS NULL AND (in_world IS NULL OR p.world = in_world)
                        AND b.x0 <= to_x AND b.y0 <= to_y AND b.z0 <= to_z
                        AND b.x1 >= from_x AND b.y1 >= from_y AND b.z1 >= from_z
                ) AS b
                JOIN (
                    SELECT object_id, page, body_no, array_value((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2) AS middle,
                        (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6 AS reach
                    FROM object_page
                ) AS g ON g.object_id = b.object_id AND g.body_no = b.body_no
                    AND array_inner_product(b.row_0, g.middle) + b.m03 BETWEEN from_x - g.reach AND to_x + g.reach
                    AND array_inner_product(b.row_1, g.middle) + b.m13 BETWEEN from_y - g.reach AND to_y + g.reach
                    AND array_inner_product(b.row_2, g.middle) + b.m23 BETWEEN from_z - g.reach AND to_z + g.reach
                JOIN object_node AS n ON n.object_id = g.object_id AND n.page = g.page
                JOIN shape AS s ON s.id = n.shape_id
            ) AS n
        ) AS c
    ) AS o
    WHERE o.x0 <= to_x AND o.y0 <= to_y AND o.z0 <= to_z AND o.x1 >= from_x AND o.y1 >= from_y AND o.z1 >= from_z
) AS h
WHERE h.x0 <= to_x AND h.y0 <= to_y AND h.z0 <= to_z AND h.x1 >= from_x AND h.y1 >= from_y AND h.z1 >= from_z;
COMMENT ON MACRO TABLE all_in_bounds IS
    'Placed parts whose world box meets a box, with pose and shape box; newest revision of all worlds or one.';

CREATE MACRO parts_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM range(checked_box(from_x, from_y, from_z, to_x, to_y, to_z))
CROSS JOIN all_in_bounds(from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS o
JOIN part ON part.id = o.part_id;
COMMENT ON MACRO TABLE parts_in_box IS
    'Placed parts whose world box meets a box; newest revision of all worlds or one.';

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
