-- Circles along which sharp edges of the inspected parts of a world run, in the world's frame; where several edges
-- run along one circle, it is given once.
-- Takes world_id; gives x, y, z (centre, mm), nx, ny, nz (unit normal, of either sign), radius (mm).
WITH placed AS (
    SELECT
        o.m00 * a.origin_x + o.m01 * a.origin_y + o.m02 * a.origin_z + o.m03 AS x,
        o.m10 * a.origin_x + o.m11 * a.origin_y + o.m12 * a.origin_z + o.m13 AS y,
        o.m20 * a.origin_x + o.m21 * a.origin_y + o.m22 * a.origin_z + o.m23 AS z,
        o.m00 * a.axis_z_x + o.m01 * a.axis_z_y + o.m02 * a.axis_z_z AS nx,
        o.m10 * a.axis_z_x + o.m11 * a.axis_z_y + o.m12 * a.axis_z_z AS ny,
        o.m20 * a.axis_z_x + o.m21 * a.axis_z_y + o.m22 * a.axis_z_z AS nz,
        a.radius
    FROM occurrence AS o
    JOIN world_object AS w ON w.world_id = o.world_id AND w.object_no = o.object_no AND w.role = 'inspected'
    JOIN shape_arc AS s ON s.shape_id = o.shape_id AND s.convexity IN ('convex', 'concave', 'free')
    JOIN arc AS a ON a.id = s.arc_id AND a.recognised_kind = 'circle' AND a.radius IS NOT NULL
    WHERE o.world_id = :world_id AND o.kind = 'part'
),
-- A normal may point either way along the axis: the first component that is not zero is made positive.
turned AS (
    SELECT x, y, z, nx, ny, nz, radius,
        CASE
            WHEN abs(nx) > 1e-6 THEN sign(nx)
            WHEN abs(ny) > 1e-6 THEN sign(ny)
            ELSE sign(nz)
        END AS side
    FROM placed
)
SELECT avg(x) AS x, avg(y) AS y, avg(z) AS z, avg(side * nx) AS nx, avg(side * ny) AS ny, avg(side * nz) AS nz,
    avg(radius) AS radius
FROM turned
GROUP BY round(x * 10), round(y * 10), round(z * 10), round(radius * 10),
    round(side * nx * 100), round(side * ny * 100), round(side * nz * 100)
ORDER BY x, y, z, radius
