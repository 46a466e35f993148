-- Which placed parts, features, surfaces and arcs lie in a box: SELECT * FROM parts_in_box(x0, y0, z0, x1, y1, z1), the
-- name of a world after them where the store holds several.  Lengths in mm, in the world's frame; touching counts.
-- A body is looked at where the box around its parts meets the box asked for, and of its pages those whose middle, carried
-- into the world, is within reach of that box: a page and all in it lie in a ball about its middle.  The boxes around the
-- placed boxes of shapes come next, and of what these let through those around the placed hulls decide.  Stages are materialised, else the planner computes every bound again wherever it is named.

CREATE INDEX object_node_page ON object_node (object_id, page);
CREATE INDEX object_node_node_no ON object_node (object_id, node_no);
CREATE INDEX placed_body_object_no ON placed_body (object_no);

CREATE FUNCTION checked_box(
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
COMMENT ON FUNCTION checked_box IS
    'True where a box is one, else an error.';

CREATE FUNCTION reach_back(
    nx DOUBLE PRECISION, ny DOUBLE PRECISION, nz DOUBLE PRECISION, shift DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) RETURNS DOUBLE PRECISION LANGUAGE sql IMMUTABLE
RETURN least(nx * x0, nx * x1) + least(ny * y0, ny * y1) + least(nz * z0, nz * z1) + shift;
COMMENT ON FUNCTION reach_back IS
    'The least n . p + shift of the points p of a box.';

CREATE FUNCTION reach_forth(
    nx DOUBLE PRECISION, ny DOUBLE PRECISION, nz DOUBLE PRECISION, shift DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) RETURNS DOUBLE PRECISION LANGUAGE sql IMMUTABLE
RETURN greatest(nx * x0, nx * x1) + greatest(ny * y0, ny * y1) + greatest(nz * z0, nz * z1) + shift;
COMMENT ON FUNCTION reach_forth IS
    'The greatest n . p + shift of the points p of a box.';

CREATE FUNCTION hull_back(
    nx DOUBLE PRECISION, ny DOUBLE PRECISION, nz DOUBLE PRECISION, shift DOUBLE PRECISION,
    xs DOUBLE PRECISION[], ys DOUBLE PRECISION[], zs DOUBLE PRECISION[]
) RETURNS DOUBLE PRECISION LANGUAGE sql IMMUTABLE
RETURN (SELECT min(nx * p.x + ny * p.y + nz * p.z) FROM unnest(xs, ys, zs) AS p (x, y, z)) + shift;
COMMENT ON FUNCTION hull_back IS
    'The least n . p + shift of the corners p of a hull; null of none.';

CREATE FUNCTION hull_forth(
    nx DOUBLE PRECISION, ny DOUBLE PRECISION, nz DOUBLE PRECISION, shift DOUBLE PRECISION,
    xs DOUBLE PRECISION[], ys DOUBLE PRECISION[], zs DOUBLE PRECISION[]
) RETURNS DOUBLE PRECISION LANGUAGE sql IMMUTABLE
RETURN (SELECT max(nx * p.x + ny * p.y + nz * p.z) FROM unnest(xs, ys, zs) AS p (x, y, z)) + shift;
COMMENT ON FUNCTION hull_forth IS
    'The greatest n . p + shift of the corners p of a hull; null of none.';

CREATE FUNCTION all_in_bounds(
    from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION,
    to_x DOUBLE PRECISION, to_y DOUBLE PRECISION, to_z DOUBLE PRECISION,
    in_world TEXT DEFAULT NULL
) RETURNS TABLE (
    world TEXT, id BIGINT, path TEXT, part_id BIGINT, shape_id BIGINT,
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    shape_x0 DOUBLE PRECISION, shape_y0 DOUBLE PRECISION, shape_z0 DOUBLE PRECISION,
    shape_x1 DOUBLE PRECISION, shape_y1 DOUBLE PRECISION, shape_z1 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
WITH near AS MATERIALIZED (
    SELECT p.world, p.name, p.object_no, p.object_id, b.body_no,
        b.m00, b.m01, b.m02, b.m03,
        b.m10, b.m11, b.m12, b.m13,
        b.m20, b.m21, b.m22, b.m23
    FROM placed_body AS b
    JOIN placed_object AS p ON p.object_no = b.object_no
    WHERE b.last_revision IS NULL AND (in_world IS NULL OR p.world = in_world)
        AND b.x0 <= to_x AND b.y0 <= to_y AND b.z0 <= to_z AND b.x1 >= from_x AND b.y1 >= from_y AND b.z1 >= from_z
        AND checked_box(from_x, from_y, from_z, to_x, to_y, to_z)
),
posed AS MATERIALIZED (
    SELECT b.world, CAST(b.object_no AS BIGINT) * 268435456 + n.node_no AS id, b.name || n.path AS path, n.part_id,
        n.shape_id,
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
    FROM near AS b
    JOIN (
        SELECT object_id, body_no, page, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
            (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6 AS reach
        FROM object_page
    ) AS g ON g.object_id = b.object_id AND g.body_no = b.body_no
        AND b.m00 * g.x + b.m01 * g.y + b.m02 * g.z + b.m03 BETWEEN from_x - g.reach AND to_x + g.reach
        AND b.m10 * g.x + b.m11 * g.y + b.m12 * g.z + b.m13 BETWEEN from_y - g.reach AND to_y + g.reach
        AND b.m20 * g.x + b.m21 * g.y + b.m22 * g.z + b.m23 BETWEEN from_z - g.reach AND to_z + g.reach
    JOIN object_node AS n ON n.object_id = g.object_id AND n.page = g.page
),
carried AS MATERIALIZED (
    SELECT o.*, s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1,
        s.z1 AS shape_z1, s.hull_x, s.hull_y, s.hull_z, s.hull_mm,
        reach_back(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS x0,
        reach_back(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS y0,
        reach_back(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS z0,
        reach_forth(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS x1,
        reach_forth(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS y1,
        reach_forth(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1) AS z1
    FROM posed AS o
    JOIN shape AS s ON s.id = o.shape_id
),
hulled AS MATERIALIZED (
    SELECT o.world, o.id, o.path, o.part_id, o.shape_id,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23,
        o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1,
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
    FROM carried AS o
    WHERE o.x0 <= to_x AND o.y0 <= to_y AND o.z0 <= to_z AND o.x1 >= from_x AND o.y1 >= from_y AND o.z1 >= from_z
)
SELECT o.world, o.id, o.path, o.part_id, o.shape_id,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM hulled AS o
WHERE o.x0 <= to_x AND o.y0 <= to_y AND o.z0 <= to_z AND o.x1 >= from_x AND o.y1 >= from_y AND o.z1 >= from_z
$$;
COMMENT ON FUNCTION all_in_bounds IS
    'Placed parts whose world box meets a box, with pose and shape box; newest revision of all worlds or one.';

CREATE FUNCTION parts_in_box(
    from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION,
    to_x DOUBLE PRECISION, to_y DOUBLE PRECISION, to_z DOUBLE PRECISION,
    in_world TEXT DEFAULT NULL
) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM all_in_bounds(from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS o
JOIN part ON part.id = o.part_id
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
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    shape_x0 DOUBLE PRECISION, shape_y0 DOUBLE PRECISION, shape_z0 DOUBLE PRECISION,
    shape_x1 DOUBLE PRECISION, shape_y1 DOUBLE PRECISION, shape_z1 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
WITH carried AS (
    SELECT o.world, o.id AS occurrence_id, o.path, o.shape_id, e.element_no,
        o.m00, o.m01, o.m02, o.m03,
        o.m10, o.m11, o.m12, o.m13,
        o.m20, o.m21, o.m22, o.m23,
        e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0, e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        reach_back(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x0,
        reach_back(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y0,
        reach_back(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z0,
        reach_forth(o.m00, o.m01, o.m02, o.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x1,
        reach_forth(o.m10, o.m11, o.m12, o.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y1,
        reach_forth(o.m20, o.m21, o.m22, o.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z1
    FROM all_in_bounds(from_x, from_y, from_z, to_x, to_y, to_z, in_world) AS o
    JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = in_level
)
SELECT c.*
FROM carried AS c
WHERE c.x0 <= to_x AND c.y0 <= to_y AND c.z0 <= to_z
    AND c.x1 >= from_x AND c.y1 >= from_y AND c.z1 >= from_z
$$;
COMMENT ON FUNCTION all_in_box IS
    'Elements of a level of placed parts whose world box meets a box, with pose and shape box; newest revision of all worlds or one.';

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
