-- Arcs that do not lie on the surface whose loop uses them: an end is further off the plane, cylinder, cone, sphere or
-- torus than the tolerance of the coedge.
-- Takes nothing; gives surface_id, loop_no, coedge_no, kind and the distance, mm.
WITH ends AS (
    SELECT id AS arc_id, start_x AS x, start_y AS y, start_z AS z FROM arc
    UNION ALL
    SELECT id, end_x, end_y, end_z FROM arc
),
placed AS (
    SELECT
        c.surface_id, c.loop_no, c.coedge_no, c.tolerance, s.kind, s.radius, s.radius2, s.semi_angle,
        (e.x - s.origin_x) * s.axis_z_x + (e.y - s.origin_y) * s.axis_z_y + (e.z - s.origin_z) * s.axis_z_z AS height,
        (e.x - s.origin_x) * (e.x - s.origin_x) + (e.y - s.origin_y) * (e.y - s.origin_y)
            + (e.z - s.origin_z) * (e.z - s.origin_z) AS square
    FROM coedge AS c
    JOIN ends AS e ON e.arc_id = c.arc_id
    JOIN surface AS s ON s.id = c.surface_id
),
cylindrical AS (  -- height above the origin along the axis, and distance from the axis
    SELECT *, sqrt(greatest(square - height * height, 0)) AS reach
    FROM placed
),
distances AS (
    SELECT
        surface_id, loop_no, coedge_no, kind, tolerance,
        CASE kind
            WHEN 'plane' THEN abs(height)
            WHEN 'cylinder' THEN abs(reach - radius)
            -- |R + h tan a| is the radius at height h; beyond the apex it is negative and the surface its mirror image.
            WHEN 'cone' THEN abs(reach - abs(radius + height * tan(semi_angle))) * cos(semi_angle)
            WHEN 'sphere' THEN abs(sqrt(square) - radius)
            -- Where the tube is wider than the ring, its far side reaches across the axis.
            WHEN 'torus' THEN least(
                abs(sqrt((reach - radius) * (reach - radius) + height * height) - radius2),
                abs(sqrt((reach + radius) * (reach + radius) + height * height) - radius2)
            )
        END AS distance
    FROM cylindrical
)
SELECT surface_id, loop_no, coedge_no, kind, max(distance) AS distance
FROM distances
WHERE distance > tolerance
GROUP BY surface_id, loop_no, coedge_no, kind
ORDER BY surface_id, loop_no, coedge_no
