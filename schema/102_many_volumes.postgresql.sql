-- Which placed parts, features, surfaces and arcs lie in each of many boxes or volumes:
-- SELECT * FROM parts_in_boxes('asked'), the name of a world after it where the store holds several.  asked: the name of
-- a table or view of volume_no and the box x0, y0, z0, x1, y1, z1, mm, in the world's frame; touching counts.
-- parts_in_volumes takes one that says besides what of the box around it a volume is: ball_x, ball_y, ball_z and
-- ball_radius (null: no ball), and half_spaces (null: none), nx, ny, nz, d of each after the other, inside where
-- n . p <= d.

CREATE FUNCTION ball_missed(
    ball_x DOUBLE PRECISION, ball_y DOUBLE PRECISION, ball_z DOUBLE PRECISION, ball_radius DOUBLE PRECISION,
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION, m10 DOUBLE PRECISION, m11 DOUBLE PRECISION,
    m12 DOUBLE PRECISION, m13 DOUBLE PRECISION, m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) RETURNS BOOLEAN LANGUAGE sql IMMUTABLE
RETURN power(greatest(x0 - (m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23)), m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23) - x1, 0), 2)
        + power(greatest(y0 - (m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23)), m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23) - y1, 0), 2)
        + power(greatest(z0 - (m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23)), m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23) - z1, 0), 2)
    > ball_radius * ball_radius;
COMMENT ON FUNCTION ball_missed IS
    'Whether a placed box does not meet a ball.';

CREATE FUNCTION all_in_boxes(in_level TEXT, asked TEXT, in_world TEXT) RETURNS SETOF placed_element LANGUAGE plpgsql STABLE AS $$
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
    FROM all_about_boxes(in_level, given.n, given.x0, given.y0, given.z0, given.x1, given.y1, given.z1, in_world);
END
$$;
COMMENT ON FUNCTION all_in_boxes IS
    'Placed parts, or their elements of a level, whose world boxes meet each of the boxes of a table.';

CREATE FUNCTION asked_volumes(asked TEXT) RETURNS TABLE (
    volume_no INTEGER, ball_x DOUBLE PRECISION, ball_y DOUBLE PRECISION, ball_z DOUBLE PRECISION, ball_radius DOUBLE PRECISION,
    half_spaces DOUBLE PRECISION[]
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

CREATE FUNCTION all_in_volumes(in_level TEXT, asked TEXT, in_world TEXT) RETURNS SETOF placed_element LANGUAGE sql STABLE AS $$
SELECT o.*
FROM all_in_boxes(in_level, asked, in_world) AS o
JOIN asked_volumes(asked) AS a ON a.volume_no = o.volume_no
WHERE (a.ball_radius IS NULL OR NOT ball_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius,
        o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23, o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1,
        o.shape_y1, o.shape_z1))
    AND NOT EXISTS (
        SELECT 1
        FROM generate_series(1, cardinality(a.half_spaces), 4) AS i
        CROSS JOIN LATERAL (
            SELECT a.half_spaces[i] AS x, a.half_spaces[i + 1] AS y, a.half_spaces[i + 2] AS z, a.half_spaces[i + 3] AS d
        ) AS p
        WHERE reach_back(
            p.x * o.m00 + p.y * o.m10 + p.z * o.m20, p.x * o.m01 + p.y * o.m11 + p.z * o.m21,
            p.x * o.m02 + p.y * o.m12 + p.z * o.m22, p.x * o.m03 + p.y * o.m13 + p.z * o.m23,
            o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1
        ) > p.d
    )
$$;
COMMENT ON FUNCTION all_in_volumes IS
    'Those of all_in_boxes that box precision finds in the volumes of the table.';
