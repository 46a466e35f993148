-- Which placed parts, features, surfaces and arcs lie in a box: SELECT * FROM parts_in_box(x0, y0, z0, x1, y1, z1), the
-- name of a world after them where the store holds several.  Lengths in mm, in the world's frame; touching counts.
-- Parts lie in the order of their pages, so that DuckDB skips row groups whose bounds are beyond the box asked for.  The
-- parts met are materialised, else the planner carries every element of the world before it asks which parts are met.
-- EXPORT DATABASE writes macros of tables in the order of their names, and IMPORT DATABASE binds each as it comes: one
-- that others ask comes before them in the alphabet, as all_in_box and, in the next file, aimed_view do.

CREATE MACRO sound_box(x0, y0, z0, x1, y1, z1) AS
    CASE WHEN x0 <= x1 AND y0 <= y1 AND z0 <= z1 AND least(x0, y0, z0) > CAST('-infinity' AS DOUBLE)
            AND greatest(x1, y1, z1) < CAST('infinity' AS DOUBLE) THEN 1
        ELSE error('the box is inverted or not finite: give x0 y0 z0 x1 y1 z1 in mm, least first') END;
COMMENT ON MACRO sound_box IS
    '1 where a box is one, else an error; as the argument of a table function, which is worked out before all else.';

CREATE MACRO parts_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT w.name AS world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM range(sound_box(from_x, from_y, from_z, to_x, to_y, to_z))
CROSS JOIN current_world AS w
JOIN occurrence AS o ON o.world_id = w.id
    AND o.x0 <= to_x AND o.y0 <= to_y AND o.z0 <= to_z
    AND o.x1 >= from_x AND o.y1 >= from_y AND o.z1 >= from_z
JOIN part ON part.id = o.part_id
WHERE in_world IS NULL OR w.name = in_world;
COMMENT ON MACRO TABLE parts_in_box IS
    'Placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE MACRO all_in_box(in_level, from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
WITH placed AS MATERIALIZED (
    SELECT w.name AS world, o.id, o.path, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23
    FROM range(sound_box(from_x, from_y, from_z, to_x, to_y, to_z))
    CROSS JOIN current_world AS w
    JOIN occurrence AS o ON o.world_id = w.id
        AND o.x0 <= to_x AND o.y0 <= to_y AND o.z0 <= to_z
        AND o.x1 >= from_x AND o.y1 >= from_y AND o.z1 >= from_z
    WHERE in_world IS NULL OR w.name = in_world
),
carried AS (
    SELECT o.world, o.id AS occurrence_id, o.path, o.shape_id, e.element_no,
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
