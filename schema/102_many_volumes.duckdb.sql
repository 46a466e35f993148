-- Which placed parts, features, surfaces and arcs lie in each of many boxes or volumes:
-- SELECT * FROM parts_in_boxes('asked'), the name of a world after it where the store holds several.  asked: the name of
-- a table or view of volume_no and the box x0, y0, z0, x1, y1, z1, mm, in the world's frame; touching counts.
-- parts_in_volumes takes one that says besides what of the box around it a volume is: ball_x, ball_y, ball_z and
-- ball_radius (null: no ball), and half_spaces (null: none), nx, ny, nz, d of each after the other, inside where
-- n . p <= d.  Pages are carried into the world once and joined with the boxes, the parts of those that are met then.

CREATE MACRO ball_missed(ball_x, ball_y, ball_z, ball_radius,
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, x0, y0, z0, x1, y1, z1) AS
    power(greatest(x0 - (m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23)), m00 * (ball_x - m03) + m10 * (ball_y - m13) + m20 * (ball_z - m23) - x1, 0), 2)
        + power(greatest(y0 - (m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23)), m01 * (ball_x - m03) + m11 * (ball_y - m13) + m21 * (ball_z - m23) - y1, 0), 2)
        + power(greatest(z0 - (m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23)), m02 * (ball_x - m03) + m12 * (ball_y - m13) + m22 * (ball_z - m23) - z1, 0), 2)
        > ball_radius * ball_radius;
COMMENT ON MACRO ball_missed IS
    'Whether a placed box does not meet a ball.';

CREATE MACRO half_spaces_missed(half_spaces,
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, x0, y0, z0, x1, y1, z1) AS
    coalesce(list_bool_or(list_transform(range(1, len(half_spaces), 4), i ->
        reach_back(
            half_spaces[i] * m00 + half_spaces[i + 1] * m10 + half_spaces[i + 2] * m20,
            half_spaces[i] * m01 + half_spaces[i + 1] * m11 + half_spaces[i + 2] * m21,
            half_spaces[i] * m02 + half_spaces[i + 1] * m12 + half_spaces[i + 2] * m22,
            half_spaces[i] * m03 + half_spaces[i + 1] * m13 + half_spaces[i + 2] * m23,
            x0, y0, z0, x1, y1, z1
        ) > half_spaces[i + 3])), FALSE);
COMMENT ON MACRO half_spaces_missed IS
    'Whether a placed box is wholly outside one of some half-spaces: nx, ny, nz, d of each after the other.';

CREATE MACRO all_in_boxes(in_level, asked, in_world) AS TABLE
SELECT *
FROM all_about_at(
    in_level,
    (SELECT list({volume_no: volume_no, x0: x0, y0: y0, z0: z0, x1: x1, y1: y1, z1: z1}) FROM query_table(asked)),
    in_world
);
COMMENT ON MACRO TABLE all_in_boxes IS
    'Placed parts, or their elements of a level, whose world boxes meet each of the boxes of a table.';

CREATE MACRO all_in_volumes(in_level, asked, in_world) AS TABLE
SELECT o.*
FROM all_in_boxes(in_level, asked, in_world) AS o
JOIN query_table(asked) AS a ON a.volume_no = o.volume_no
WHERE (a.ball_radius IS NULL OR NOT ball_missed(a.ball_x, a.ball_y, a.ball_z, a.ball_radius,
        o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23, o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1,
        o.shape_y1, o.shape_z1))
    AND (a.half_spaces IS NULL OR NOT half_spaces_missed(a.half_spaces,
        o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23, o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1,
        o.shape_y1, o.shape_z1));
COMMENT ON MACRO TABLE all_in_volumes IS
    'Those of all_in_boxes that box precision finds in the volumes of the table.';
