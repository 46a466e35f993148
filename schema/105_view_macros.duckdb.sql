-- Which placed parts, features, surfaces and arcs lie in a ball or in a camera's view, for any client:
--     SELECT * FROM parts_in_sphere(x, y, z, radius)
--     SELECT * FROM parts_in_view(camera_id, c00, c01, c02, c03, c10, ..., c23, near, far)
-- and the same of features, surfaces and arcs; the name of a world after them where the store holds several.  Lengths
-- in mm; c00 .. c23 are world_from_camera (x right, y down, z forward).  The view is the least picture without
-- distortion that holds all that the camera sees.  What is given back is that whose box in its shape's frame, as it
-- lies in the world, meets the ball or is not wholly outside any face of the view or of the box around it.
-- Numbers are cast: what a person types is a DECIMAL to DuckDB, whose products overflow.  Every expression stands once,
-- in subqueries one inside the other, for DuckDB takes longer to plan than to answer.

CREATE MACRO beyond(least_x, least_y, least_z, most_x, most_y, most_z) AS
    power(greatest(least_x, most_x, 0), 2) + power(greatest(least_y, most_y, 0), 2)
        + power(greatest(least_z, most_z, 0), 2);
COMMENT ON MACRO beyond IS
    'The square of the distance of a point from a box, of how far it is before the least and beyond the most bounds.';

CREATE MACRO checked_ball(radius) AS
    CASE WHEN radius >= 0 AND radius < CAST('infinity' AS DOUBLE) THEN 1
        ELSE error('the radius of the sphere is below zero or not finite: give one of at least 0 mm') END;
COMMENT ON MACRO checked_ball IS
    '1 where a radius is one, else an error.';

CREATE MACRO checked_depths(near, far) AS
    CASE WHEN 0 <= near AND near < far AND far < CAST('infinity' AS DOUBLE) THEN 1
        ELSE error('the view has no depth: give finite depths in mm, 0 <= near < far') END;
COMMENT ON MACRO checked_depths IS
    '1 where two depths of a view are so, else an error.';

CREATE MACRO all_in_bounds_of_ball(at_x, at_y, at_z, radius, in_world := NULL) AS TABLE
SELECT o.*,
    o.m00 * (CAST(at_x AS DOUBLE) - o.m03) + o.m10 * (CAST(at_y AS DOUBLE) - o.m13)
        + o.m20 * (CAST(at_z AS DOUBLE) - o.m23) AS centre_x,
    o.m01 * (CAST(at_x AS DOUBLE) - o.m03) + o.m11 * (CAST(at_y AS DOUBLE) - o.m13)
        + o.m21 * (CAST(at_z AS DOUBLE) - o.m23) AS centre_y,
    o.m02 * (CAST(at_x AS DOUBLE) - o.m03) + o.m12 * (CAST(at_y AS DOUBLE) - o.m13)
        + o.m22 * (CAST(at_z AS DOUBLE) - o.m23) AS centre_z
FROM range(checked_ball(radius))
CROSS JOIN all_in_bounds(
    CAST(at_x AS DOUBLE) - radius, CAST(at_y AS DOUBLE) - radius, CAST(at_z AS DOUBLE) - radius,
    CAST(at_x AS DOUBLE) + radius, CAST(at_y AS DOUBLE) + radius, CAST(at_z AS DOUBLE) + radius, in_world
) AS o;
COMMENT ON MACRO TABLE all_in_bounds_of_ball IS
    'Placed parts whose world box meets the box around a ball, with its centre in their shapes'' frames.';

CREATE MACRO parts_in_sphere(at_x, at_y, at_z, radius, in_world := NULL) AS TABLE
SELECT h.world, h.id AS occurrence_id, h.path, part.name, h.x0, h.y0, h.z0, h.x1, h.y1, h.z1
FROM all_in_bounds_of_ball(at_x, at_y, at_z, radius, in_world) AS h
JOIN part ON part.id = h.part_id
WHERE beyond(
    h.shape_x0 - h.centre_x, h.shape_y0 - h.centre_y, h.shape_z0 - h.centre_z,
    h.centre_x - h.shape_x1, h.centre_y - h.shape_y1, h.centre_z - h.shape_z1
) <= CAST(radius AS DOUBLE) * radius;
COMMENT ON MACRO TABLE parts_in_sphere IS
    'Placed parts whose box meets a ball; newest revision of all worlds or one.';

CREATE MACRO all_in_sphere(in_level, at_x, at_y, at_z, radius, in_world := NULL) AS TABLE
WITH placed AS MATERIALIZED (
    SELECT * FROM all_in_bounds_of_ball(at_x, at_y, at_z, radius, in_world)
),
carried AS (
    SELECT p.* EXCLUDE (shape_x0, shape_y0, shape_z0, shape_x1, shape_y1, shape_z1, x0, y0, z0, x1, y1, z1), e.element_no,
        e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0,
        e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        reach_back(p.m00, p.m01, p.m02, p.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x0,
        reach_back(p.m10, p.m11, p.m12, p.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y0,
        reach_back(p.m20, p.m21, p.m22, p.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z0,
        reach_forth(p.m00, p.m01, p.m02, p.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x1,
        reach_forth(p.m10, p.m11, p.m12, p.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y1,
        reach_forth(p.m20, p.m21, p.m22, p.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z1
    FROM placed AS p
    JOIN shape_box AS e ON e.shape_id = p.shape_id AND e.level = in_level
)
SELECT h.world, h.id AS occurrence_id, h.path, h.shape_id, h.element_no, h.x0, h.y0, h.z0, h.x1, h.y1, h.z1
FROM carried AS h
WHERE beyond(
    h.shape_x0 - h.centre_x, h.shape_y0 - h.centre_y, h.shape_z0 - h.centre_z,
    h.centre_x - h.shape_x1, h.centre_y - h.shape_y1, h.centre_z - h.shape_z1
) <= CAST(radius AS DOUBLE) * radius
    AND h.x0 <= CAST(at_x AS DOUBLE) + radius AND h.x1 >= CAST(at_x AS DOUBLE) - radius
    AND h.y0 <= CAST(at_y AS DOUBLE) + radius AND h.y1 >= CAST(at_y AS DOUBLE) - radius
    AND h.z0 <= CAST(at_z AS DOUBLE) + radius AND h.z1 >= CAST(at_z AS DOUBLE) - radius;
COMMENT ON MACRO TABLE all_in_sphere IS
    'Elements of a level of placed parts whose box meets a ball; newest revision of all worlds or one.';

CREATE MACRO features_in_sphere(at_x, at_y, at_z, radius, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS feature_no,
    f.name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_sphere('feature', at_x, at_y, at_z, radius, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no;
COMMENT ON MACRO TABLE features_in_sphere IS
    'Features of placed parts whose box meets a ball; newest revision of all worlds or one.';

CREATE MACRO surfaces_in_sphere(at_x, at_y, at_z, radius, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_sphere('surface', at_x, at_y, at_z, radius, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no;
COMMENT ON MACRO TABLE surfaces_in_sphere IS
    'Surfaces of placed parts whose box meets a ball; newest revision of all worlds or one.';

CREATE MACRO arcs_in_sphere(at_x, at_y, at_z, radius, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_sphere('arc', at_x, at_y, at_z, radius, in_world) AS e;
COMMENT ON MACRO TABLE arcs_in_sphere IS
    'Arcs of placed parts whose box meets a ball; newest revision of all worlds or one.';

CREATE MACRO aimed_view(in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far) AS TABLE
SELECT
    v.c03 + least(v.near * v.least_x, v.far * v.least_x) AS low_x,
    v.c13 + least(v.near * v.least_y, v.far * v.least_y) AS low_y,
    v.c23 + least(v.near * v.least_z, v.far * v.least_z) AS low_z,
    v.c03 + greatest(v.near * v.most_x, v.far * v.most_x) AS high_x,
    v.c13 + greatest(v.near * v.most_y, v.far * v.most_y) AS high_y,
    v.c23 + greatest(v.near * v.most_z, v.far * v.most_z) AS high_z,
    v.c00 * -v.fx + v.c01 * -v.skew + v.c02 * v.left_x AS left_x,
    v.c10 * -v.fx + v.c11 * -v.skew + v.c12 * v.left_x AS left_y,
    v.c20 * -v.fx + v.c21 * -v.skew + v.c22 * v.left_x AS left_z,
    v.c00 * v.fx + v.c01 * v.skew + v.c02 * -v.right_x AS right_x,
    v.c10 * v.fx + v.c11 * v.skew + v.c12 * -v.right_x AS right_y,
    v.c20 * v.fx + v.c21 * v.skew + v.c22 * -v.right_x AS right_z,
    v.c01 * -v.fy + v.c02 * v.top_y AS top_x,
    v.c11 * -v.fy + v.c12 * v.top_y AS top_y,
    v.c21 * -v.fy + v.c22 * v.top_y AS top_z,
    v.c01 * v.fy + v.c02 * -v.bottom_y AS bottom_x,
    v.c11 * v.fy + v.c12 * -v.bottom_y AS bottom_y,
    v.c21 * v.fy + v.c22 * -v.bottom_y AS bottom_z,
    v.c02 AS forward_x, v.c12 AS forward_y, v.c22 AS forward_z,
    v.c03, v.c13, v.c23, v.near, v.far
FROM (
    SELECT r.*,
        least(r.x00, r.x10, r.x01, r.x11) AS least_x,
        greatest(r.x00, r.x10, r.x01, r.x11) AS most_x,
        least(r.y00, r.y10, r.y01, r.y11) AS least_y,
        greatest(r.y00, r.y10, r.y01, r.y11) AS most_y,
        least(r.z00, r.z10, r.z01, r.z11) AS least_z,
        greatest(r.z00, r.z10, r.z01, r.z11) AS most_z
    FROM (  -- the rays through the corners of the picture, to a depth of 1
        SELECT p.*,
            p.c00 * p.u00 + p.c01 * p.v0 + p.c02 AS x00, p.c00 * p.u10 + p.c01 * p.v0 + p.c02 AS x10,
            p.c00 * p.u01 + p.c01 * p.v1 + p.c02 AS x01, p.c00 * p.u11 + p.c01 * p.v1 + p.c02 AS x11,
            p.c10 * p.u00 + p.c11 * p.v0 + p.c12 AS y00, p.c10 * p.u10 + p.c11 * p.v0 + p.c12 AS y10,
            p.c10 * p.u01 + p.c11 * p.v1 + p.c12 AS y01, p.c10 * p.u11 + p.c11 * p.v1 + p.c12 AS y11,
            p.c20 * p.u00 + p.c21 * p.v0 + p.c22 AS z00, p.c20 * p.u10 + p.c21 * p.v0 + p.c22 AS z10,
            p.c20 * p.u01 + p.c21 * p.v1 + p.c22 AS z01, p.c20 * p.u11 + p.c21 * p.v1 + p.c22 AS z11
        FROM (
            SELECT
                CAST(c00 AS DOUBLE) AS c00, CAST(c01 AS DOUBLE) AS c01,
                CAST(c02 AS DOUBLE) AS c02, CAST(c03 AS DOUBLE) AS c03,
                CAST(c10 AS DOUBLE) AS c10, CAST(c11 AS DOUBLE) AS c11,
                CAST(c12 AS DOUBLE) AS c12, CAST(c13 AS DOUBLE) AS c13,
                CAST(c20 AS DOUBLE) AS c20, CAST(c21 AS DOUBLE) AS c21,
                CAST(c22 AS DOUBLE) AS c22, CAST(c23 AS DOUBLE) AS c23,
                CAST(near AS DOUBLE) AS near, CAST(far AS DOUBLE) AS far, c.fx, c.fy, c.skew,
                c.view_u0 - c.cx AS left_x, c.view_u1 - c.cx AS right_x,
                c.view_v0 - c.cy AS top_y, c.view_v1 - c.cy AS bottom_y,
                (c.view_v0 - c.cy) / c.fy AS v0, (c.view_v1 - c.cy) / c.fy AS v1,
                (c.view_u0 - c.cx - c.skew * (c.view_v0 - c.cy) / c.fy) / c.fx AS u00,
                (c.view_u1 - c.cx - c.skew * (c.view_v0 - c.cy) / c.fy) / c.fx AS u10,
                (c.view_u0 - c.cx - c.skew * (c.view_v1 - c.cy) / c.fy) / c.fx AS u01,
                (c.view_u1 - c.cx - c.skew * (c.view_v1 - c.cy) / c.fy) / c.fx AS u11
            FROM camera AS c
            WHERE c.id = in_camera
        ) AS p
    ) AS r
) AS v;
COMMENT ON MACRO TABLE aimed_view IS
    'The view of a camera between two depths: the box around it, outward normals of its sides, and the way it looks.';

CREATE MACRO all_in_bounds_of_view(
    in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far, in_world := NULL) AS TABLE
SELECT o.*, v.low_x, v.low_y, v.low_z, v.high_x, v.high_y, v.high_z, v.near, v.far,
    v.left_x * o.m00 + v.left_y * o.m10 + v.left_z * o.m20 AS left0,
    v.left_x * o.m01 + v.left_y * o.m11 + v.left_z * o.m21 AS left1,
    v.left_x * o.m02 + v.left_y * o.m12 + v.left_z * o.m22 AS left2,
    v.left_x * (o.m03 - v.c03) + v.left_y * (o.m13 - v.c13) + v.left_z * (o.m23 - v.c23) AS left3,
    v.right_x * o.m00 + v.right_y * o.m10 + v.right_z * o.m20 AS right0,
    v.right_x * o.m01 + v.right_y * o.m11 + v.right_z * o.m21 AS right1,
    v.right_x * o.m02 + v.right_y * o.m12 + v.right_z * o.m22 AS right2,
    v.right_x * (o.m03 - v.c03) + v.right_y * (o.m13 - v.c13) + v.right_z * (o.m23 - v.c23) AS right3,
    v.top_x * o.m00 + v.top_y * o.m10 + v.top_z * o.m20 AS top0,
    v.top_x * o.m01 + v.top_y * o.m11 + v.top_z * o.m21 AS top1,
    v.top_x * o.m02 + v.top_y * o.m12 + v.top_z * o.m22 AS top2,
    v.top_x * (o.m03 - v.c03) + v.top_y * (o.m13 - v.c13) + v.top_z * (o.m23 - v.c23) AS top3,
    v.bottom_x * o.m00 + v.bottom_y * o.m10 + v.bottom_z * o.m20 AS bottom0,
    v.bottom_x * o.m01 + v.bottom_y * o.m11 + v.bottom_z * o.m21 AS bottom1,
    v.bottom_x * o.m02 + v.bottom_y * o.m12 + v.bottom_z * o.m22 AS bottom2,
    v.bottom_x * (o.m03 - v.c03) + v.bottom_y * (o.m13 - v.c13) + v.bottom_z * (o.m23 - v.c23) AS bottom3,
    v.forward_x * o.m00 + v.forward_y * o.m10 + v.forward_z * o.m20 AS forward0,
    v.forward_x * o.m01 + v.forward_y * o.m11 + v.forward_z * o.m21 AS forward1,
    v.forward_x * o.m02 + v.forward_y * o.m12 + v.forward_z * o.m22 AS forward2,
    v.forward_x * (o.m03 - v.c03) + v.forward_y * (o.m13 - v.c13) + v.forward_z * (o.m23 - v.c23) AS forward3
FROM aimed_view(in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far) AS v
CROSS JOIN range(checked_depths(near, far))
CROSS JOIN all_in_bounds(v.low_x, v.low_y, v.low_z, v.high_x, v.high_y, v.high_z, in_world) AS o;
COMMENT ON MACRO TABLE all_in_bounds_of_view IS
    'Placed parts whose world box meets the box around a view, with its faces in their shapes'' frames.';

CREATE MACRO parts_in_view(
    in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far, in_world := NULL) AS TABLE
SELECT h.world, h.id AS occurrence_id, h.path, part.name, h.x0, h.y0, h.z0, h.x1, h.y1, h.z1
FROM all_in_bounds_of_view(in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far,
    in_world) AS h
JOIN part ON part.id = h.part_id
WHERE reach_back(h.left0, h.left1, h.left2, h.left3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.right0, h.right1, h.right2, h.right3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.top0, h.top1, h.top2, h.top3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.bottom0, h.bottom1, h.bottom2, h.bottom3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.forward0, h.forward1, h.forward2, h.forward3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= h.far
    AND reach_back(-h.forward0, -h.forward1, -h.forward2, -h.forward3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= -h.near;
COMMENT ON MACRO TABLE parts_in_view IS
    'Placed parts whose box meets the view of a camera; newest revision of all worlds or one.';

CREATE MACRO all_in_view(
    in_level, in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far, in_world := NULL
) AS TABLE
WITH placed AS MATERIALIZED (
    SELECT *
    FROM all_in_bounds_of_view(in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far,
        in_world)
),
carried AS (
    SELECT p.* EXCLUDE (shape_x0, shape_y0, shape_z0, shape_x1, shape_y1, shape_z1, x0, y0, z0, x1, y1, z1), e.element_no,
        e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0,
        e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        reach_back(p.m00, p.m01, p.m02, p.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x0,
        reach_back(p.m10, p.m11, p.m12, p.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y0,
        reach_back(p.m20, p.m21, p.m22, p.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z0,
        reach_forth(p.m00, p.m01, p.m02, p.m03, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS x1,
        reach_forth(p.m10, p.m11, p.m12, p.m13, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS y1,
        reach_forth(p.m20, p.m21, p.m22, p.m23, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1) AS z1
    FROM placed AS p
    JOIN shape_box AS e ON e.shape_id = p.shape_id AND e.level = in_level
)
SELECT h.world, h.id AS occurrence_id, h.path, h.shape_id, h.element_no, h.x0, h.y0, h.z0, h.x1, h.y1, h.z1
FROM carried AS h
WHERE reach_back(h.left0, h.left1, h.left2, h.left3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.right0, h.right1, h.right2, h.right3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.top0, h.top1, h.top2, h.top3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.bottom0, h.bottom1, h.bottom2, h.bottom3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= 0
    AND reach_back(h.forward0, h.forward1, h.forward2, h.forward3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= h.far
    AND reach_back(-h.forward0, -h.forward1, -h.forward2, -h.forward3, h.shape_x0, h.shape_y0, h.shape_z0,
        h.shape_x1, h.shape_y1, h.shape_z1) <= -h.near
    AND h.x0 <= h.high_x AND h.x1 >= h.low_x AND h.y0 <= h.high_y AND h.y1 >= h.low_y
    AND h.z0 <= h.high_z AND h.z1 >= h.low_z;
COMMENT ON MACRO TABLE all_in_view IS
    'Elements of a level of placed parts whose box meets the view of a camera; newest revision of all worlds or one.';

CREATE MACRO features_in_view(
    in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS feature_no,
    f.name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_view('feature', in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23,
    near, far, in_world) AS e
JOIN feature AS f ON f.shape_id = e.shape_id AND f.feature_no = e.element_no;
COMMENT ON MACRO TABLE features_in_view IS
    'Features of placed parts whose box meets the view of a camera; newest revision of all worlds or one.';

CREATE MACRO surfaces_in_view(
    in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS surface_no,
    coalesce(s.name, 'surface ' || CAST(e.element_no AS TEXT)) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_view('surface', in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23,
    near, far, in_world) AS e
LEFT JOIN shape_surface AS s ON s.shape_id = e.shape_id AND s.surface_no = e.element_no;
COMMENT ON MACRO TABLE surfaces_in_view IS
    'Surfaces of placed parts whose box meets the view of a camera; newest revision of all worlds or one.';

CREATE MACRO arcs_in_view(
    in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23, near, far, in_world := NULL) AS TABLE
SELECT e.world, e.occurrence_id, e.path, e.element_no AS arc_no,
    'arc ' || CAST(e.element_no AS TEXT) AS name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM all_in_view('arc', in_camera, c00, c01, c02, c03, c10, c11, c12, c13, c20, c21, c22, c23,
    near, far, in_world) AS e;
COMMENT ON MACRO TABLE arcs_in_view IS
    'Arcs of placed parts whose box meets the view of a camera; newest revision of all worlds or one.';
