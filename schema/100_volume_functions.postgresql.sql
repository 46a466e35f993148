-- Which placed parts, features, surfaces and arcs lie in a box: SELECT * FROM parts_in_box(x0, y0, z0, x1, y1, z1), the
-- name of a world after them where the store holds several.  Lengths in mm, in the world's frame; touching counts.
-- A page of boxes is looked at only where its own box meets the box asked for.  The parts met are materialised, else
-- the planner carries every element of the world before it asks which parts are met.

CREATE INDEX occurrence_page ON occurrence (world_id, page);

CREATE FUNCTION sound_box(
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) RETURNS BOOLEAN LANGUAGE plpgsql STABLE STRICT AS $$
BEGIN
    IF x0 <= x1 AND y0 <= y1 AND z0 <= z1 AND least(x0, y0, z0) > CAST('-infinity' AS DOUBLE PRECISION)
        AND greatest(x1, y1, z1) < CAST('infinity' AS DOUBLE PRECISION) THEN
        RETURN TRUE;
    END IF;
    RAISE 'the box is inverted or not finite: give x0 y0 z0 x1 y1 z1 in mm, least first';
END
$$;
COMMENT ON FUNCTION sound_box IS
    'True where a box is one, else an error.';

CREATE FUNCTION parts_in_box(
    from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION,
    to_x DOUBLE PRECISION, to_y DOUBLE PRECISION, to_z DOUBLE PRECISION,
    in_world TEXT DEFAULT NULL
) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
WITH met AS MATERIALIZED (
    SELECT w.name AS world, o.id, o.path, o.part_id, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
    FROM current_world AS w
    JOIN box_page AS p ON p.world_id = w.id
        AND p.x0 <= to_x AND p.y0 <= to_y AND p.z0 <= to_z
        AND p.x1 >= from_x AND p.y1 >= from_y AND p.z1 >= from_z
    JOIN occurrence AS o ON o.world_id = p.world_id AND o.page = p.page
        AND o.x0 <= to_x AND o.y0 <= to_y AND o.z0 <= to_z
        AND o.x1 >= from_x AND o.y1 >= from_y AND o.z1 >= from_z
    WHERE (in_world IS NULL OR w.name = in_world) AND sound_box(from_x, from_y, from_z, to_x, to_y, to_z)
)
SELECT met.world, met.id AS occurrence_id, met.path, part.name, met.x0, met.y0, met.z0, met.x1, met.y1, met.z1
FROM met
JOIN part ON part.id = met.part_id
$$;
COMMENT ON FUNCTION parts_in_box IS
    'Placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE FUNCTION all_in_box(
    in_level TEXT,
    from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION,
    to_x DOUBLE PRECISION, to_y DOUBLE PRECISION, to_z DOUBLE PRECISION,
    in_world TEXT DEFAULT NULL
) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, shape_id BIGINT, element_no INTEGER,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
WITH placed AS MATERIALIZED (
    SELECT w.name AS world, o.id, o.path, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23
    FROM current_world AS w
    JOIN box_page AS p ON p.world_id = w.id
        AND p.x0 <= to_x AND p.y0 <= to_y AND p.z0 <= to_z
        AND p.x1 >= from_x AND p.y1 >= from_y AND p.z1 >= from_z
    JOIN occurrence AS o ON o.world_id = p.world_id AND o.page = p.page
        AND o.x0 <= to_x AND o.y0 <= to_y AND o.z0 <= to_z
        AND o.x1 >= from_x AND o.y1 >= from_y AND o.z1 >= from_z
    WHERE (in_world IS NULL OR w.name = in_world) AND sound_box(from_x, from_y, from_z, to_x, to_y, to_z)
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
    AND c.x1 >= from_x AND c.y1 >= from_y AND c.z1 >= from_z
$$;
COMMENT ON FUNCTION all_in_box IS
    'Elements of a level of placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE FUNCTION features_in_box(
    from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION,
    to_x DOUBLE PRECISION, to_y DOUBLE PRECISION, to_z DOUBLE PRECISION,
    in_world TEXT DEFAULT NULL
) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, feature_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.world, e.occurrence_id, e.path, e.element_no AS feature_no, f.name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_box('feature', from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no
$$;
COMMENT ON FUNCTION features_in_box IS
    'Features of placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE FUNCTION surfaces_in_box(
    from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION,
    to_x DOUBLE PRECISION, to_y DOUBLE PRECISION, to_z DOUBLE PRECISION,
    in_world TEXT DEFAULT NULL
) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, surface_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_box('surface', from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no
$$;
COMMENT ON FUNCTION surfaces_in_box IS
    'Surfaces of placed parts whose world box meets a box; newest revision of all worlds or one.';

CREATE FUNCTION arcs_in_box(
    from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION,
    to_x DOUBLE PRECISION, to_y DOUBLE PRECISION, to_z DOUBLE PRECISION,
    in_world TEXT DEFAULT NULL
) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, arc_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_box('arc', from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS e
$$;
COMMENT ON FUNCTION arcs_in_box IS
    'Arcs of placed parts whose world box meets a box; newest revision of all worlds or one.';
