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
SELECT o.*
FROM all_about_boxes(
    (SELECT list(volume_no ORDER BY volume_no) FROM query_table(asked)),
    (SELECT list(x0 ORDER BY volume_no) FROM query_table(asked)), (SELECT list(y0 ORDER BY volume_no) FROM query_table(asked)),
    (SELECT list(z0 ORDER BY volume_no) FROM query_table(asked)), (SELECT list(x1 ORDER BY volume_no) FROM query_table(asked)),
    (SELECT list(y1 ORDER BY volume_no) FROM query_table(asked)), (SELECT list(z1 ORDER BY volume_no) FROM query_table(asked)),
    in_world
) AS o;
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
