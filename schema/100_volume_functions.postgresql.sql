-- Which placed parts, features, surfaces and arcs lie in a box: SELECT * FROM parts_in_box(x0, y0, z0, x1, y1, z1), the
-- name of a world after them where the store holds several.  Lengths in mm, in the world's frame; touching counts.
-- A body is looked at where the box around its parts meets the box asked for, and of its pages and then of its parts those
-- whose box in the body's frame, carried into the world, meets it.  Pages are found by an index of the balls about them,
-- over x and y of the body's frame, into which the box asked for is carried.  Of what is left the boxes around the placed
-- boxes of the shapes, and then those around the placed hulls, decide.  Stages are materialised, else the planner computes
-- every bound again wherever it is named.

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

CREATE FUNCTION page_ball(
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) RETURNS box LANGUAGE sql IMMUTABLE
RETURN box(
    point((x0 + x1) / 2 - (x1 - x0 + y1 - y0 + z1 - z0) / 2 - 1e-6, (y0 + y1) / 2 - (x1 - x0 + y1 - y0 + z1 - z0) / 2 - 1e-6),
    point((x0 + x1) / 2 + (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6, (y0 + y1) / 2 + (x1 - x0 + y1 - y0 + z1 - z0) / 2 + 1e-6)
);
COMMENT ON FUNCTION page_ball IS
    'The x and y of the box around a ball about the middle of a box that holds the box.';
CREATE INDEX object_page_ball ON object_page USING gist (page_ball(x0, y0, z0, x1, y1, z1));

CREATE FUNCTION asked_in_body(
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m03 DOUBLE PRECISION, m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) RETURNS box LANGUAGE sql IMMUTABLE
RETURN box(
    point(least(m00 * (x0 - m03), m00 * (x1 - m03)) + least(m10 * (y0 - m13), m10 * (y1 - m13))
            + least(m20 * (z0 - m23), m20 * (z1 - m23)),
        least(m01 * (x0 - m03), m01 * (x1 - m03)) + least(m11 * (y0 - m13), m11 * (y1 - m13))
            + least(m21 * (z0 - m23), m21 * (z1 - m23))),
    point(greatest(m00 * (x0 - m03), m00 * (x1 - m03)) + greatest(m10 * (y0 - m13), m10 * (y1 - m13))
            + greatest(m20 * (z0 - m23), m20 * (z1 - m23)),
        greatest(m01 * (x0 - m03), m01 * (x1 - m03)) + greatest(m11 * (y0 - m13), m11 * (y1 - m13))
            + greatest(m21 * (z0 - m23), m21 * (z1 - m23)))
);
COMMENT ON FUNCTION asked_in_body IS
    'The x and y of the box around a box of the world in the frame of a body.';

CREATE TYPE placed_element AS (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, shape_id BIGINT, element_no INTEGER, name TEXT,
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    shape_x0 DOUBLE PRECISION, shape_y0 DOUBLE PRECISION, shape_z0 DOUBLE PRECISION, shape_x1 DOUBLE PRECISION, shape_y1 DOUBLE PRECISION,
    shape_z1 DOUBLE PRECISION,
    part_x0 DOUBLE PRECISION, part_y0 DOUBLE PRECISION, part_z0 DOUBLE PRECISION, part_x1 DOUBLE PRECISION, part_y1 DOUBLE PRECISION,
    part_z1 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
);
COMMENT ON TYPE placed_element IS
    'A placed part, or an element of one: its pose, its box in the shape''s frame, its part''s box and its own in the world, mm.';

CREATE FUNCTION all_about_boxes(
    in_level TEXT, volume_nos INTEGER[], xs0 DOUBLE PRECISION[], ys0 DOUBLE PRECISION[], zs0 DOUBLE PRECISION[], xs1 DOUBLE PRECISION[],
    ys1 DOUBLE PRECISION[], zs1 DOUBLE PRECISION[], in_world TEXT
) RETURNS SETOF placed_element LANGUAGE sql STABLE AS $$
WITH asked_box AS MATERIALIZED (
    SELECT *
    FROM unnest(volume_nos, xs0, ys0, zs0, xs1, ys1, zs1) AS q (volume_no, x0, y0, z0, x1, y1, z1)
),
near_body AS MATERIALIZED (
    SELECT a.volume_no, a.x0, a.y0, a.z0, a.x1, a.y1, a.z1, p.world, p.name, p.object_no, p.object_id, b.body_no,
        b.m00, b.m01, b.m02, b.m03, b.m10, b.m11, b.m12, b.m13, b.m20, b.m21, b.m22, b.m23
    FROM asked_box AS a
    JOIN placed_body AS b ON b.x0 <= a.x1 AND b.y0 <= a.y1 AND b.z0 <= a.z1
        AND b.x1 >= a.x0 AND b.y1 >= a.y0 AND b.z1 >= a.z0
    JOIN placed_object AS p ON p.object_no = b.object_no
    WHERE b.last_revision IS NULL AND (in_world IS NULL OR p.world = in_world)
),
near AS MATERIALIZED (  -- parts whose box in the body's frame, carried into the world, meets the box asked
    SELECT b.volume_no, b.x0 AS least_x, b.y0 AS least_y, b.z0 AS least_z,
        b.x1 AS most_x, b.y1 AS most_y, b.z1 AS most_z, b.world,
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
    FROM (
        SELECT b.*, g.page
        FROM near_body AS b
        JOIN object_page AS g ON g.object_id = b.object_id AND g.body_no = b.body_no
            AND page_ball(g.x0, g.y0, g.z0, g.x1, g.y1, g.z1) && asked_in_body(
                b.m00, b.m01, b.m03, b.m10, b.m11, b.m13, b.m20, b.m21, b.m23, b.x0, b.y0, b.z0, b.x1, b.y1, b.z1)
            AND abs(b.m00 * (g.x0 + g.x1) / 2 + b.m01 * (g.y0 + g.y1) / 2 + b.m02 * (g.z0 + g.z1) / 2 + b.m03 - (b.x0 + b.x1) / 2)
                <= (abs(b.m00) * (g.x1 - g.x0) + abs(b.m01) * (g.y1 - g.y0) + abs(b.m02) * (g.z1 - g.z0) + b.x1 - b.x0) / 2 + 1e-6
            AND abs(b.m10 * (g.x0 + g.x1) / 2 + b.m11 * (g.y0 + g.y1) / 2 + b.m12 * (g.z0 + g.z1) / 2 + b.m13 - (b.y0 + b.y1) / 2)
                <= (abs(b.m10) * (g.x1 - g.x0) + abs(b.m11) * (g.y1 - g.y0) + abs(b.m12) * (g.z1 - g.z0) + b.y1 - b.y0) / 2 + 1e-6
            AND abs(b.m20 * (g.x0 + g.x1) / 2 + b.m21 * (g.y0 + g.y1) / 2 + b.m22 * (g.z0 + g.z1) / 2 + b.m23 - (b.z0 + b.z1) / 2)
                <= (abs(b.m20) * (g.x1 - g.x0) + abs(b.m21) * (g.y1 - g.y0) + abs(b.m22) * (g.z1 - g.z0) + b.z1 - b.z0) / 2 + 1e-6
        OFFSET 0  -- else the nodes come first
    ) AS b
    JOIN object_node AS n ON n.object_id = b.object_id AND n.page = b.page
        AND abs(b.m00 * (n.x0 + n.x1) / 2 + b.m01 * (n.y0 + n.y1) / 2 + b.m02 * (n.z0 + n.z1) / 2 + b.m03 - (b.x0 + b.x1) / 2)
            <= (abs(b.m00) * (n.x1 - n.x0) + abs(b.m01) * (n.y1 - n.y0) + abs(b.m02) * (n.z1 - n.z0) + b.x1 - b.x0) / 2 + 1e-6
        AND abs(b.m10 * (n.x0 + n.x1) / 2 + b.m11 * (n.y0 + n.y1) / 2 + b.m12 * (n.z0 + n.z1) / 2 + b.m13 - (b.y0 + b.y1) / 2)
            <= (abs(b.m10) * (n.x1 - n.x0) + abs(b.m11) * (n.y1 - n.y0) + abs(b.m12) * (n.z1 - n.z0) + b.y1 - b.y0) / 2 + 1e-6
        AND abs(b.m20 * (n.x0 + n.x1) / 2 + b.m21 * (n.y0 + n.y1) / 2 + b.m22 * (n.z0 + n.z1) / 2 + b.m23 - (b.z0 + b.z1) / 2)
            <= (abs(b.m20) * (n.x1 - n.x0) + abs(b.m21) * (n.y1 - n.y0) + abs(b.m22) * (n.z1 - n.z0) + b.z1 - b.z0) / 2 + 1e-6
),
met AS MATERIALIZED (  -- by the boxes around the placed boxes of the shapes and around the placed hulls
    SELECT o.*
    FROM (
        SELECT o.*, s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
            greatest(reach_back(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1), h.x0 + o.m03 - s.hull_mm) AS x0,
            greatest(reach_back(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1), h.y0 + o.m13 - s.hull_mm) AS y0,
            greatest(reach_back(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1), h.z0 + o.m23 - s.hull_mm) AS z0,
            least(reach_forth(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1), h.x1 + o.m03 + s.hull_mm) AS x1,
            least(reach_forth(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1), h.y1 + o.m13 + s.hull_mm) AS y1,
            least(reach_forth(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1), h.z1 + o.m23 + s.hull_mm) AS z1
        FROM near AS o
        JOIN shape AS s ON s.id = o.shape_id
        CROSS JOIN LATERAL (  -- all six at once: a function of lists, which is not taken in, takes ten times as long
            SELECT min(o.m00 * p.x + o.m01 * p.y + o.m02 * p.z) AS x0, min(o.m10 * p.x + o.m11 * p.y + o.m12 * p.z) AS y0,
            min(o.m20 * p.x + o.m21 * p.y + o.m22 * p.z) AS z0,
                max(o.m00 * p.x + o.m01 * p.y + o.m02 * p.z) AS x1, max(o.m10 * p.x + o.m11 * p.y + o.m12 * p.z) AS y1,
                max(o.m20 * p.x + o.m21 * p.y + o.m22 * p.z) AS z1
            FROM (SELECT unnest(s.hull_x) AS x, unnest(s.hull_y) AS y, unnest(s.hull_z) AS z) AS p
        ) AS h
    ) AS o
    WHERE o.x0 <= o.most_x AND o.y0 <= o.most_y AND o.z0 <= o.most_z
        AND o.x1 >= o.least_x AND o.y1 >= o.least_y AND o.z1 >= o.least_z
)
SELECT o.volume_no, o.world, o.occurrence_id, o.path, o.shape_id, -1, p.name,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM met AS o
JOIN part AS p ON p.id = o.part_id
WHERE in_level = 'part'
UNION ALL
SELECT o.volume_no, o.world, o.occurrence_id, o.path, o.shape_id, o.element_no, o.name,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1, o.part_x0, o.part_y0, o.part_z0, o.part_x1, o.part_y1, o.part_z1, o.x0,
    o.y0, o.z0, o.x1, o.y1, o.z1
FROM (
    SELECT o.volume_no, o.least_x, o.least_y, o.least_z, o.most_x, o.most_y, o.most_z, o.world, o.occurrence_id, o.path, o.shape_id,
        o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
        e.element_no, e.name, e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0, e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        o.x0 AS part_x0, o.y0 AS part_y0, o.z0 AS part_z0, o.x1 AS part_x1, o.y1 AS part_y1, o.z1 AS part_z1,
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
    AND o.x1 >= o.least_x AND o.y1 >= o.least_y AND o.z1 >= o.least_z
$$;
COMMENT ON FUNCTION all_about_boxes IS
    'Placed parts, or their elements of a level, whose world boxes meet each of the boxes given by columns; newest revision of all worlds or one.';

CREATE FUNCTION all_about_box(
    in_level TEXT, from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION, to_x DOUBLE PRECISION, to_y DOUBLE PRECISION,
    to_z DOUBLE PRECISION, in_world TEXT
) RETURNS SETOF placed_element LANGUAGE sql STABLE AS $$
SELECT *
FROM all_about_boxes(in_level, ARRAY[0], ARRAY[from_x], ARRAY[from_y], ARRAY[from_z], ARRAY[to_x], ARRAY[to_y], ARRAY[to_z], in_world)
$$;
COMMENT ON FUNCTION all_about_box IS
    'The same of one box.';

CREATE FUNCTION all_in_box(
    in_level TEXT, from_x DOUBLE PRECISION, from_y DOUBLE PRECISION, from_z DOUBLE PRECISION, to_x DOUBLE PRECISION, to_y DOUBLE PRECISION,
    to_z DOUBLE PRECISION, in_world TEXT
) RETURNS SETOF placed_element LANGUAGE sql STABLE AS $$
SELECT *
FROM all_about_box(
    in_level, CASE WHEN checked_box(from_x, from_y, from_z, to_x, to_y, to_z) THEN from_x END, from_y, from_z, to_x, to_y, to_z, in_world
)
$$;
COMMENT ON FUNCTION all_in_box IS
    'The same of a box that a person gives.';

CREATE FUNCTION all_nearest(
    in_level TEXT, at_x DOUBLE PRECISION, at_y DOUBLE PRECISION, at_z DOUBLE PRECISION, how_many BIGINT, in_world TEXT
) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, element_no INTEGER, name TEXT, x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION, distance_mm DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
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
SELECT o.world, o.occurrence_id, o.path, o.element_no, o.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1, sqrt(
        power(greatest(o.x0 - at_x, at_x - o.x1, o.part_x0 - at_x, at_x - o.part_x1, 0), 2)
        + power(greatest(o.y0 - at_y, at_y - o.y1, o.part_y0 - at_y, at_y - o.part_y1, 0), 2)
        + power(greatest(o.z0 - at_z, at_z - o.z1, o.part_z0 - at_z, at_z - o.part_z1, 0), 2)
    ) AS distance_mm
FROM enough AS r
CROSS JOIN LATERAL all_about_box(
    in_level, at_x - r.reach, at_y - r.reach, at_z - r.reach, at_x + r.reach, at_y + r.reach, at_z + r.reach, in_world
) AS o
ORDER BY distance_mm, o.occurrence_id, o.element_no
LIMIT how_many
$$;
COMMENT ON FUNCTION all_nearest IS
    'The placed parts, or their elements of a level, nearest to a point, so many, and how far their boxes in their parts'' boxes are, mm.';
