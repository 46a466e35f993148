-- Which placed parts, features, surfaces and arcs lie in each of many boxes or volumes:
-- SELECT * FROM parts_in_boxes('asked'), the name of a world after it where the store holds several.  asked: the name of
-- a table or view of volume_no and the box x0, y0, z0, x1, y1, z1, mm, in the world's frame; touching counts.
-- parts_in_volumes takes one that says besides what of the box around it a volume is: ball_x, ball_y, ball_z and
-- ball_radius (null: no ball), and half_spaces (null: none), nx, ny, nz, d of each after the other, inside where
-- n . p <= d.

CREATE FUNCTION volume_missed(
    ball_x DOUBLE PRECISION, ball_y DOUBLE PRECISION, ball_z DOUBLE PRECISION, ball_radius DOUBLE PRECISION, half_spaces DOUBLE PRECISION[],
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) RETURNS BOOLEAN LANGUAGE sql IMMUTABLE
RETURN coalesce(ball_radius IS NOT NULL AND power(greatest(x0 - (m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23)), m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23) - x1, 0), 2)
        + power(greatest(y0 - (m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23)), m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23) - y1, 0), 2)
        + power(greatest(z0 - (m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23)), m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23) - z1, 0), 2)
        > ball_radius * ball_radius, FALSE)
    OR EXISTS (
        SELECT 1
        FROM generate_series(1, cardinality(half_spaces), 4) AS i
        WHERE reach_back(
            half_spaces[i] * m00 + half_spaces[i + 1] * m10 + half_spaces[i + 2] * m20,
            half_spaces[i] * m01 + half_spaces[i + 1] * m11 + half_spaces[i + 2] * m21,
            half_spaces[i] * m02 + half_spaces[i + 1] * m12 + half_spaces[i + 2] * m22,
            half_spaces[i] * m03 + half_spaces[i + 1] * m13 + half_spaces[i + 2] * m23,
            x0, y0, z0, x1, y1, z1
        ) > half_spaces[i + 3]
    );
COMMENT ON FUNCTION volume_missed IS
    'Whether a placed box does not meet a ball or is wholly outside one of some half-spaces, each null where there is none.';

CREATE FUNCTION all_in_boxes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, least_x DOUBLE PRECISION, least_y DOUBLE PRECISION, least_z DOUBLE PRECISION, most_x DOUBLE PRECISION, most_y DOUBLE PRECISION, most_z DOUBLE PRECISION,
    world TEXT, id BIGINT, path TEXT, part_id BIGINT, shape_id BIGINT,
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    shape_x0 DOUBLE PRECISION, shape_y0 DOUBLE PRECISION, shape_z0 DOUBLE PRECISION, shape_x1 DOUBLE PRECISION, shape_y1 DOUBLE PRECISION, shape_z1 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE plpgsql STABLE AS $$
DECLARE
    given RECORD;
BEGIN
    EXECUTE concat(
        'SELECT array_agg(CAST(volume_no AS INTEGER)) AS n, array_agg(CAST(x0 AS DOUBLE PRECISION)) AS x0, '
        'array_agg(CAST(y0 AS DOUBLE PRECISION)) AS y0, array_agg(CAST(z0 AS DOUBLE PRECISION)) AS z0, '
        'array_agg(CAST(x1 AS DOUBLE PRECISION)) AS x1, array_agg(CAST(y1 AS DOUBLE PRECISION)) AS y1, '
        'array_agg(CAST(z1 AS DOUBLE PRECISION)) AS z1 FROM ', CAST(asked AS REGCLASS)
    ) INTO given;
    RETURN QUERY SELECT *
    FROM all_about_boxes(given.n, given.x0, given.y0, given.z0, given.x1, given.y1, given.z1, in_world);
END
$$;
COMMENT ON FUNCTION all_in_boxes IS
    'Placed parts whose world box meets each of the boxes of a table, with pose and shape box; newest revision of all worlds or one.';

CREATE FUNCTION all_in_boxes_of_level(in_level TEXT, asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, least_x DOUBLE PRECISION, least_y DOUBLE PRECISION, least_z DOUBLE PRECISION, most_x DOUBLE PRECISION, most_y DOUBLE PRECISION, most_z DOUBLE PRECISION,
    world TEXT, occurrence_id BIGINT, path TEXT, shape_id BIGINT, element_no INTEGER,
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    shape_x0 DOUBLE PRECISION, shape_y0 DOUBLE PRECISION, shape_z0 DOUBLE PRECISION, shape_x1 DOUBLE PRECISION, shape_y1 DOUBLE PRECISION, shape_z1 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
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
    AND c.x1 >= c.least_x AND c.y1 >= c.least_y AND c.z1 >= c.least_z
$$;
COMMENT ON FUNCTION all_in_boxes_of_level IS
    'Elements of a level of placed parts whose world box meets each of the boxes of a table, with pose and shape box.';

CREATE FUNCTION asked_volumes(asked TEXT) RETURNS TABLE (
    volume_no INTEGER, ball_x DOUBLE PRECISION, ball_y DOUBLE PRECISION, ball_z DOUBLE PRECISION, ball_radius DOUBLE PRECISION, half_spaces DOUBLE PRECISION[]
) LANGUAGE plpgsql STABLE AS $$
BEGIN
    RETURN QUERY EXECUTE concat(
        'SELECT CAST(volume_no AS INTEGER), CAST(ball_x AS DOUBLE PRECISION), CAST(ball_y AS DOUBLE PRECISION), '
        'CAST(ball_z AS DOUBLE PRECISION), CAST(ball_radius AS DOUBLE PRECISION), '
        'CAST(half_spaces AS DOUBLE PRECISION[]) FROM ', CAST(asked AS REGCLASS)
    );
END
$$;
COMMENT ON FUNCTION asked_volumes IS
    'What of the boxes around them the volumes of a table are.';

CREATE FUNCTION parts_in_boxes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT o.volume_no, o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM all_in_boxes(asked, in_world) AS o
JOIN part ON part.id = o.part_id
$$;
COMMENT ON FUNCTION parts_in_boxes IS
    'Placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE FUNCTION features_in_boxes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, feature_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS feature_no, f.name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('feature', asked, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no
$$;
COMMENT ON FUNCTION features_in_boxes IS
    'Features of placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE FUNCTION surfaces_in_boxes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, surface_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('surface', asked, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no
$$;
COMMENT ON FUNCTION surfaces_in_boxes IS
    'Surfaces of placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE FUNCTION arcs_in_boxes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, arc_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('arc', asked, in_world) AS e
$$;
COMMENT ON FUNCTION arcs_in_boxes IS
    'Arcs of placed parts whose world box meets each of the boxes of a table; newest revision of all worlds or one.';

CREATE FUNCTION parts_in_volumes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT o.volume_no, o.world, o.id AS occurrence_id, o.path, part.name, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1
FROM all_in_boxes(asked, in_world) AS o
JOIN part ON part.id = o.part_id
JOIN asked_volumes(asked) AS a ON a.volume_no = o.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1)
$$;
COMMENT ON FUNCTION parts_in_volumes IS
    'Placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';

CREATE FUNCTION features_in_volumes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, feature_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS feature_no, f.name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('feature', asked, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no
JOIN asked_volumes(asked) AS a ON a.volume_no = e.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    e.m00, e.m01, e.m02, e.m03, e.m10, e.m11, e.m12, e.m13, e.m20, e.m21, e.m22, e.m23,
    e.shape_x0, e.shape_y0, e.shape_z0, e.shape_x1, e.shape_y1, e.shape_z1)
$$;
COMMENT ON FUNCTION features_in_volumes IS
    'Features of placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';

CREATE FUNCTION surfaces_in_volumes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, surface_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('surface', asked, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no
JOIN asked_volumes(asked) AS a ON a.volume_no = e.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    e.m00, e.m01, e.m02, e.m03, e.m10, e.m11, e.m12, e.m13, e.m20, e.m21, e.m22, e.m23,
    e.shape_x0, e.shape_y0, e.shape_z0, e.shape_x1, e.shape_y1, e.shape_z1)
$$;
COMMENT ON FUNCTION surfaces_in_volumes IS
    'Surfaces of placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';

CREATE FUNCTION arcs_in_volumes(asked TEXT, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    volume_no INTEGER, world TEXT, occurrence_id BIGINT, path TEXT, arc_no INTEGER, name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT e.volume_no, e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name,
    e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_boxes_of_level('arc', asked, in_world) AS e
JOIN asked_volumes(asked) AS a ON a.volume_no = e.volume_no
WHERE NOT volume_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius, a.half_spaces,
    e.m00, e.m01, e.m02, e.m03, e.m10, e.m11, e.m12, e.m13, e.m20, e.m21, e.m22, e.m23,
    e.shape_x0, e.shape_y0, e.shape_z0, e.shape_x1, e.shape_y1, e.shape_z1)
$$;
COMMENT ON FUNCTION arcs_in_volumes IS
    'Arcs of placed parts that box precision finds in each of the volumes of a table; newest revision of all worlds or one.';
