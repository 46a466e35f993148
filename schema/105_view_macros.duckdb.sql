-- Which placed parts, features, surfaces and arcs lie in a ball or in a camera's view, for any client:
--     SELECT * FROM parts_in_sphere(x, y, z, radius)
--     SELECT * FROM parts_in_view(camera_id, c00, c01, c02, c03, c10, ..., c23, near, far)
-- and the same of features, surfaces and arcs; the name of a world after them where the store holds several.  Lengths
-- in mm; c00 .. c23 are world_from_camera (x right, y down, z forward).  The view is the least picture without
-- distortion that holds all that the camera sees.  What is given back is that whose box in its shape's frame, as it
-- lies in the world, meets the ball or is not wholly outside any face of the view or of the box around it.
-- Numbers are cast: what a person types is a DECIMAL to DuckDB, whose products overflow.

CREATE MACRO checked_ball(radius) AS
    CASE WHEN radius >= 0 AND radius < CAST('infinity' AS DOUBLE) THEN 0
        ELSE error('the radius of the sphere is below zero or not finite: give one of at least 0 mm') END;
COMMENT ON MACRO checked_ball IS
    '0 where a radius is one, else an error.';

CREATE MACRO checked_depths(near, far) AS
    CASE WHEN 0 <= near AND near < far AND far < CAST('infinity' AS DOUBLE) THEN 0
        ELSE error('the view has no depth: give finite depths in mm, 0 <= near < far') END;
COMMENT ON MACRO checked_depths IS
    '0 where two depths of a view are so, else an error.';

CREATE MACRO aimed_view(in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far) AS TABLE
SELECT
    min(c00 * q.x + c01 * q.y + c02 * q.z + c03) AS x0, min(c10 * q.x + c11 * q.y + c12 * q.z + c13) AS y0,
    min(c20 * q.x + c21 * q.y + c22 * q.z + c23) AS z0, max(c00 * q.x + c01 * q.y + c02 * q.z + c03) AS x1,
    max(c10 * q.x + c11 * q.y + c12 * q.z + c13) AS y1, max(c20 * q.x + c21 * q.y + c22 * q.z + c23) AS z1,
    any_value(flatten(list_transform(q.planes, p -> [
        c00 * p[1] + c01 * p[2] + c02 * p[3], c10 * p[1] + c11 * p[2] + c12 * p[3], c20 * p[1] + c21 * p[2] + c22 * p[3],
        (c00 * c03 + c10 * c13 + c20 * c23) * p[1] + (c01 * c03 + c11 * c13 + c21 * c23) * p[2]
            + (c02 * c03 + c12 * c13 + c22 * c23) * p[3] + p[4]
    ]))) AS half_spaces
FROM (
    SELECT d.depth * (u.u - c.cx - c.skew * (v.v - c.cy) / c.fy) / c.fx AS x, d.depth * (v.v - c.cy) / c.fy AS y, d.depth AS z,
        [[-c.fx, -c.skew, c.view_u0 - c.cx, 0], [c.fx, c.skew, c.cx - c.view_u1, 0], [0, -c.fy, c.view_v0 - c.cy, 0],
            [0, c.fy, c.cy - c.view_v1, 0], [0, 0, -1, -near], [0, 0, 1, far]] AS planes
    FROM camera AS c
    CROSS JOIN unnest([c.view_u0, c.view_u1]) AS u (u)
    CROSS JOIN unnest([c.view_v0, c.view_v1]) AS v (v)
    CROSS JOIN unnest([near, far]) AS d (depth)
    WHERE c.id = in_camera
) AS q;
COMMENT ON MACRO TABLE aimed_view IS
    'The view of a camera between two depths: the box around it, and its faces as half-spaces; nulls of an unknown camera.';

CREATE MACRO all_in_sphere(in_level, at_x, at_y, at_z, radius, in_world) AS TABLE
SELECT o.*
FROM all_about_at(
    in_level,
    [{
        volume_no: checked_ball(radius), x0: CAST(at_x AS DOUBLE) - radius, y0: CAST(at_y AS DOUBLE) - radius,
        z0: CAST(at_z AS DOUBLE) - radius, x1: CAST(at_x AS DOUBLE) + radius, y1: CAST(at_y AS DOUBLE) + radius,
        z1: CAST(at_z AS DOUBLE) + radius
    }],
    in_world
) AS o
WHERE NOT ball_missed(CAST(at_x AS DOUBLE), CAST(at_y AS DOUBLE), CAST(at_z AS DOUBLE), CAST(radius AS DOUBLE),
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1);
COMMENT ON MACRO TABLE all_in_sphere IS
    'Placed parts, or their elements of a level, whose box meets a ball.';

CREATE MACRO all_in_view(in_level, in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far, in_world) AS TABLE
WITH aimed AS MATERIALIZED (
    SELECT *
    FROM aimed_view(in_camera, CAST(c00 AS DOUBLE), CAST(c01 AS DOUBLE), CAST(c02 AS DOUBLE), CAST(c03 AS DOUBLE), CAST(c10 AS DOUBLE),
        CAST(c11 AS DOUBLE), CAST(c12 AS DOUBLE), CAST(c13 AS DOUBLE), CAST(c20 AS DOUBLE), CAST(c21 AS DOUBLE), CAST(c22 AS DOUBLE),
        CAST(c23 AS DOUBLE),
        CAST(near AS DOUBLE), CAST(far AS DOUBLE))
)
SELECT o.*
FROM all_about_at(
    in_level,
    (SELECT list({volume_no: checked_depths(near, far), x0: x0, y0: y0, z0: z0, x1: x1, y1: y1, z1: z1}) FROM aimed),
    in_world
) AS o
CROSS JOIN aimed AS v
WHERE NOT half_spaces_missed(v.half_spaces,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1);
COMMENT ON MACRO TABLE all_in_view IS
    'Placed parts, or their elements of a level, whose box meets the view of a camera.';
