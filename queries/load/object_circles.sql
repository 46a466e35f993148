-- Circles along which sharp edges of an object's parts run, in its frame; where several edges run along one circle, it
-- is given once.  Parts that joints move are left out.  Of very many parts the greatest are looked at.
-- Takes object_id, least_radius, greatest_radius (mm), most_parts; gives x, y, z (centre, mm), nx, ny, nz
-- (unit normal, its first component that is not zero positive), radius (mm).
WITH great AS (
    SELECT shape_id, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_node
    WHERE object_id = :object_id AND part_id IS NOT NULL AND body_no = 0
    ORDER BY (x1 - x0) + (y1 - y0) + (z1 - z0) DESC, node_no
    LIMIT :most_parts
),
placed AS (
    SELECT
        o.m00 * a.origin_x + o.m01 * a.origin_y + o.m02 * a.origin_z + o.m03 AS x,
        o.m10 * a.origin_x + o.m11 * a.origin_y + o.m12 * a.origin_z + o.m13 AS y,
        o.m20 * a.origin_x + o.m21 * a.origin_y + o.m22 * a.origin_z + o.m23 AS z,
        o.m00 * a.axis_z_x + o.m01 * a.axis_z_y + o.m02 * a.axis_z_z AS nx,
        o.m10 * a.axis_z_x + o.m11 * a.axis_z_y + o.m12 * a.axis_z_z AS ny,
        o.m20 * a.axis_z_x + o.m21 * a.axis_z_y + o.m22 * a.axis_z_z AS nz,
        a.radius
    FROM great AS o
    JOIN shape_arc AS s ON s.shape_id = o.shape_id AND s.convexity IN ('convex', 'concave', 'free')
    JOIN arc AS a ON a.id = s.arc_id AND a.recognised_kind = 'circle'
    WHERE a.radius BETWEEN :least_radius AND :greatest_radius
),
turned AS (
    SELECT x, y, z, nx, ny, nz, radius,
        CASE
            WHEN abs(nx) > 1e-6 THEN sign(nx)
            WHEN abs(ny) > 1e-6 THEN sign(ny)
            ELSE sign(nz)
        END AS side
    FROM placed
)
SELECT min(x) AS x, min(y) AS y, min(z) AS z,
    min(side * nx) AS nx, min(side * ny) AS ny, min(side * nz) AS nz, min(radius) AS radius
FROM turned
GROUP BY round(x * 10), round(y * 10), round(z * 10), round(radius * 10),
    round(side * nx * 100), round(side * ny * 100), round(side * nz * 100)
ORDER BY x, y, z, radius, nx, ny, nz
