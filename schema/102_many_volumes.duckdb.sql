-- Which placed parts, features, surfaces and arcs lie in each of many boxes or volumes:
-- SELECT * FROM parts_in_boxes('asked'), the name of a world after it where the store holds several.  asked: the name of
-- a table or view of volume_no and the box x0, y0, z0, x1, y1, z1, mm, in the world's frame; touching counts.
-- parts_in_volumes takes one that says besides what of the box around it a volume is: ball_x, ball_y, ball_z and
-- ball_radius (null: no ball), and half_spaces (null: none), nx, ny, nz, d of each after the other, inside where
-- n . p <= d.  Pages are carried into the world once and joined with the boxes, the parts of those that are met then.

CREATE MACRO volume_missed(ball_x, ball_y, ball_z, ball_radius, half_spaces,
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, x0, y0, z0, x1, y1, z1) AS
    coalesce(ball_radius IS NOT NULL AND power(greatest(x0 - (m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23)), m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23) - x1, 0), 2)
        + power(greatest(y0 - (m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23)), m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23) - y1, 0), 2)
        + power(greatest(z0 - (m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23)), m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23) - z1, 0), 2)
        > ball_radius * ball_radius, FALSE)
    OR coalesce(list_bool_or(list_transform(range(1, len(half_spaces), 4), i ->
        reach_back(
            half_spaces[i] * m00 + half_spaces[i + 1] * m10 + half_spaces[i + 2] * m20,
            half_spaces[i] * m01 + half_spaces[i + 1] * m11 + half_spaces[i + 2] * m21,
            half_spaces[i] * m02 + half_spaces[i + 1] * m12 + half_spaces[i + 2] * m22,
            half_spaces[i] * m03 + half_spaces[i + 1] * m13 + half_spaces[i + 2] * m23,
            x0, y0, z0, x1, y1, z1
        ) > half_spaces[i + 3])), FALSE);
COMMENT ON MACRO volume_missed IS
    'Whether a placed box does not meet a ball or is wholly outside one of some half-spaces, each null where there is none.';

CREATE MACRO all_in_boxes(asked, in_world := NULL) AS TABLE
WITH asked_box AS MATERIALIZED (
    SELECT volume_no, x0, y0, z0, x1, y1, z1 FROM query_table(asked)
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
met_page AS MATERIALIZED (
    SELECT a.volume_no, a.x0, a.y0, a.z0, a.x1, a.y1, a.z1, g.object_no, g.body_no, g.page
    FROM asked_box AS a
    JOIN placed_page AS g ON g.x0 <= a.x1 AND g.x1 >= a.x0 AND g.y0 <= a.y1 AND g.y1 >= a.y0 AND g.z0 <= a.z1 AND g.z1 >= a.z0
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
COMMENT ON MACRO TABLE all_in_boxes IS
    'Placed parts whose world box meets each of the boxes of a table, with pose and shape box; newest revision of all worlds or one.';

CREATE MACRO all_in_boxes_of_level(in_level, asked, in_world := NULL) AS TABLE
WITH carried AS (
    SELECT o.volume_no, o.least_x, o.least_y, o.least_z, o.most_x, o.most_y, o.most_z, o.world,
        o.id AS occurrence_id, o.path, o.shape_id, e.element_no,
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
    FROM all_in_boxes(asked, in_world) AS o
    JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = in_level
)
SELECT c.*
FROM carried AS c
WHERE c.x0 <= c.most_x AND c.y0 <= c.most_y AND c.z0 <= c.most_z
    AND c.x1 >= c.least_x AND c.y1 >= c.least_y AND c.z1 >= c.least_z;
COMMENT ON MACRO TABLE all_in_boxes_of_level IS
    'Elements of a level of placed parts whose world box meets each of the boxes of a table, with pose and shape box.';

CREATE MACRO parts_in_boxes(asked, in_world := NULL) AS TABLE
SELECT o.volume_no, o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM all_in_boxes(asked, in_world) AS o
JOIN part ON part.id = o.part_id;
COMMENT ON MACRO TABLE parts_in_boxes IS
    'Placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE MACRO features_in_boxes(asked, in_world := NULL) AS TABLE
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS feature_no, f.name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('feature', asked, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no;
COMMENT ON MACRO TABLE features_in_boxes IS
    'Features of placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE MACRO surfaces_in_boxes(asked, in_world := NULL) AS TABLE
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('surface', asked, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no;
COMMENT ON MACRO TABLE surfaces_in_boxes IS
    'Surfaces of placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE MACRO arcs_in_boxes(asked, in_world := NULL) AS TABLE
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('arc', asked, in_world) AS e;
COMMENT ON MACRO TABLE arcs_in_boxes IS
    'Arcs of placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE MACRO parts_in_volumes(asked, in_world := NULL) AS TABLE
SELECT o.volume_no, o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM all_in_boxes(asked, in_world) AS o
JOIN part ON part.id = o.part_id
JOIN query_table(asked) AS a ON a.volume_no = o.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1);
COMMENT ON MACRO TABLE parts_in_volumes IS
    'Placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';

CREATE MACRO features_in_volumes(asked, in_world := NULL) AS TABLE
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS feature_no, f.name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('feature', asked, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no
JOIN query_table(asked) AS a ON a.volume_no = e.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    e.m00, e.m01, e.m02, e.m03, e.m10, e.m11, e.m12, e.m13, e.m20, e.m21, e.m22, e.m23,
    e.shape_x0, e.shape_y0, e.shape_z0, e.shape_x1, e.shape_y1, e.shape_z1);
COMMENT ON MACRO TABLE features_in_volumes IS
    'Features of placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';

CREATE MACRO surfaces_in_volumes(asked, in_world := NULL) AS TABLE
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('surface', asked, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no
JOIN query_table(asked) AS a ON a.volume_no = e.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    e.m00, e.m01, e.m02, e.m03, e.m10, e.m11, e.m12, e.m13, e.m20, e.m21, e.m22, e.m23,
    e.shape_x0, e.shape_y0, e.shape_z0, e.shape_x1, e.shape_y1, e.shape_z1);
COMMENT ON MACRO TABLE surfaces_in_volumes IS
    'Surfaces of placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';

CREATE MACRO arcs_in_volumes(asked, in_world := NULL) AS TABLE
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('arc', asked, in_world) AS e
JOIN query_table(asked) AS a ON a.volume_no = e.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    e.m00, e.m01, e.m02, e.m03, e.m10, e.m11, e.m12, e.m13, e.m20, e.m21, e.m22, e.m23,
    e.shape_x0, e.shape_y0, e.shape_z0, e.shape_x1, e.shape_y1, e.shape_z1);
COMMENT ON MACRO TABLE arcs_in_volumes IS
    'Arcs of placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';
