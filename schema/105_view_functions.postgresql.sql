-- Which placed parts, features, surfaces and arcs lie in a ball or in a camera's view, for any client:
--     SELECT * FROM parts_in_sphere(x, y, z, radius)
--     SELECT * FROM parts_in_view(camera_id, c00, c01, c02, c03, c10, ..., c23, near, far)
-- and the same of features, surfaces and arcs; the name of a world after them where the store holds several.  Lengths in
-- mm; c00 .. c23 are world_from_camera (x right, y down, z forward).  The view is the least picture without distortion
-- that holds all that the camera sees.  What is given back is that whose box in its shape's frame, as it lies in the
-- world, meets the ball or is not wholly outside any face of the view or of the box around it.

CREATE FUNCTION checked_ball(radius DOUBLE PRECISION) RETURNS BOOLEAN LANGUAGE plpgsql STABLE STRICT AS $$
BEGIN
    IF radius >= 0 AND radius < CAST('infinity' AS DOUBLE PRECISION) THEN
        RETURN TRUE;
    END IF;
    RAISE 'the radius of the sphere is below zero or not finite: give one of at least 0 mm';
END
$$;
COMMENT ON FUNCTION checked_ball IS
    'True where a radius is one, else an error.';

CREATE FUNCTION checked_depths(near DOUBLE PRECISION, far DOUBLE PRECISION) RETURNS BOOLEAN LANGUAGE plpgsql STABLE STRICT AS $$
BEGIN
    IF 0 <= near AND near < far AND far < CAST('infinity' AS DOUBLE PRECISION) THEN
        RETURN TRUE;
    END IF;
    RAISE 'the view has no depth: give finite depths in mm, 0 <= near < far';
END
$$;
COMMENT ON FUNCTION checked_depths IS
    'True where two depths of a view are so, else an error.';

CREATE FUNCTION view_box(
    in_camera BIGINT, c00 DOUBLE PRECISION, c01 DOUBLE PRECISION, c02 DOUBLE PRECISION, c03 DOUBLE PRECISION, c10 DOUBLE PRECISION,
    c11 DOUBLE PRECISION, c12 DOUBLE PRECISION, c13 DOUBLE PRECISION, c20 DOUBLE PRECISION, c21 DOUBLE PRECISION, c22 DOUBLE PRECISION,
    c23 DOUBLE PRECISION, near DOUBLE PRECISION, far DOUBLE PRECISION
) RETURNS TABLE (
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT
    min(c00 * x + c01 * y + c02 * z + c03) AS x0,
    min(c10 * x + c11 * y + c12 * z + c13) AS y0,
    min(c20 * x + c21 * y + c22 * z + c23) AS z0,
    max(c00 * x + c01 * y + c02 * z + c03) AS x1,
    max(c10 * x + c11 * y + c12 * z + c13) AS y1,
    max(c20 * x + c21 * y + c22 * z + c23) AS z1
FROM (
    SELECT depth * (u - c.cx - c.skew * (v - c.cy) / c.fy) / c.fx AS x, depth * (v - c.cy) / c.fy AS y, depth AS z
    FROM camera AS c
    CROSS JOIN LATERAL (SELECT c.view_u0 AS u UNION ALL SELECT c.view_u1) AS across
    CROSS JOIN LATERAL (SELECT c.view_v0 AS v UNION ALL SELECT c.view_v1) AS down
    CROSS JOIN (SELECT near AS depth UNION ALL SELECT far) AS depths
    WHERE c.id = in_camera
) AS corner
$$;
COMMENT ON FUNCTION view_box IS
    'The box around the view of a camera between two depths.';

CREATE FUNCTION view_planes(
    in_camera BIGINT, c00 DOUBLE PRECISION, c01 DOUBLE PRECISION, c02 DOUBLE PRECISION, c03 DOUBLE PRECISION, c10 DOUBLE PRECISION,
    c11 DOUBLE PRECISION, c12 DOUBLE PRECISION, c13 DOUBLE PRECISION, c20 DOUBLE PRECISION, c21 DOUBLE PRECISION, c22 DOUBLE PRECISION,
    c23 DOUBLE PRECISION, near DOUBLE PRECISION, far DOUBLE PRECISION
) RETURNS TABLE (nx DOUBLE PRECISION, ny DOUBLE PRECISION, nz DOUBLE PRECISION, d DOUBLE PRECISION) LANGUAGE sql STABLE AS $$
SELECT w.nx, w.ny, w.nz, w.nx * c03 + w.ny * c13 + w.nz * c23 + q.d AS d
FROM (
    SELECT -c.fx AS x, -c.skew AS y, c.view_u0 - c.cx AS z, 0.0 AS d FROM camera AS c WHERE c.id = in_camera
    UNION ALL
    SELECT c.fx, c.skew, c.cx - c.view_u1, 0.0 FROM camera AS c WHERE c.id = in_camera
    UNION ALL
    SELECT 0.0, -c.fy, c.view_v0 - c.cy, 0.0 FROM camera AS c WHERE c.id = in_camera
    UNION ALL
    SELECT 0.0, c.fy, c.cy - c.view_v1, 0.0 FROM camera AS c WHERE c.id = in_camera
    UNION ALL
    SELECT 0.0, 0.0, -1.0, -near
    UNION ALL
    SELECT 0.0, 0.0, 1.0, far
) AS q
CROSS JOIN LATERAL (
    SELECT c00 * q.x + c01 * q.y + c02 * q.z AS nx, c10 * q.x + c11 * q.y + c12 * q.z AS ny,
        c20 * q.x + c21 * q.y + c22 * q.z AS nz
) AS w
$$;
COMMENT ON FUNCTION view_planes IS
    'The faces of the view of a camera between two depths: outward normals n and offsets d; inside where n . p <= d.';

CREATE FUNCTION all_in_sphere(
    in_level TEXT, at_x DOUBLE PRECISION, at_y DOUBLE PRECISION, at_z DOUBLE PRECISION, radius DOUBLE PRECISION, in_world TEXT
) RETURNS SETOF placed_element LANGUAGE sql STABLE AS $$
SELECT o.*
FROM all_about_box(
    in_level, CASE WHEN checked_ball(radius) THEN at_x - radius END, at_y - radius, at_z - radius,
    at_x + radius, at_y + radius, at_z + radius, in_world
) AS o
WHERE NOT ball_missed(at_x, at_y, at_z, radius,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23, o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1,
    o.shape_z1)
$$;
COMMENT ON FUNCTION all_in_sphere IS
    'Placed parts, or their elements of a level, whose box meets a ball.';

CREATE FUNCTION all_in_view(
    in_level TEXT, in_camera BIGINT, c00 DOUBLE PRECISION, c01 DOUBLE PRECISION, c02 DOUBLE PRECISION, c03 DOUBLE PRECISION, c10 DOUBLE PRECISION,
    c11 DOUBLE PRECISION, c12 DOUBLE PRECISION, c13 DOUBLE PRECISION, c20 DOUBLE PRECISION, c21 DOUBLE PRECISION, c22 DOUBLE PRECISION,
    c23 DOUBLE PRECISION, near DOUBLE PRECISION, far DOUBLE PRECISION, in_world TEXT
) RETURNS SETOF placed_element LANGUAGE sql STABLE AS $$
SELECT o.*
FROM view_box(in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far) AS b
CROSS JOIN LATERAL all_about_box(in_level, b.x0, b.y0, b.z0, b.x1, b.y1, b.z1, in_world) AS o
WHERE checked_depths(near, far) AND NOT EXISTS (
    SELECT 1
    FROM view_planes(in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far) AS p
    WHERE reach_back(
        p.nx * o.m00 + p.ny * o.m10 + p.nz * o.m20, p.nx * o.m01 + p.ny * o.m11 + p.nz * o.m21,
        p.nx * o.m02 + p.ny * o.m12 + p.nz * o.m22, p.nx * o.m03 + p.ny * o.m13 + p.nz * o.m23,
        o.shape_x0, o.shape_y0, o.shape_z0, o.shape_x1, o.shape_y1, o.shape_z1
    ) > p.d
)
$$;
COMMENT ON FUNCTION all_in_view IS
    'Placed parts, or their elements of a level, whose box meets the view of a camera.';
