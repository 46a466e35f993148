-- Parts of expanded objects without a box, or whose box is not that of their shape carried into the body's frame, to
-- 1e-6 mm.
-- Takes nothing; gives object_id, path and the greatest difference of a bound, mm (null: no box).
WITH carried AS (  -- centre and half extent: |R| h bounds the turned box
    SELECT
        o.object_id, o.path, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
        o.m00 * (s.x0 + s.x1) / 2 + o.m01 * (s.y0 + s.y1) / 2 + o.m02 * (s.z0 + s.z1) / 2 + o.m03 AS cx,
        o.m10 * (s.x0 + s.x1) / 2 + o.m11 * (s.y0 + s.y1) / 2 + o.m12 * (s.z0 + s.z1) / 2 + o.m13 AS cy,
        o.m20 * (s.x0 + s.x1) / 2 + o.m21 * (s.y0 + s.y1) / 2 + o.m22 * (s.z0 + s.z1) / 2 + o.m23 AS cz,
        abs(o.m00) * (s.x1 - s.x0) / 2 + abs(o.m01) * (s.y1 - s.y0) / 2 + abs(o.m02) * (s.z1 - s.z0) / 2 AS hx,
        abs(o.m10) * (s.x1 - s.x0) / 2 + abs(o.m11) * (s.y1 - s.y0) / 2 + abs(o.m12) * (s.z1 - s.z0) / 2 AS hy,
        abs(o.m20) * (s.x1 - s.x0) / 2 + abs(o.m21) * (s.y1 - s.y0) / 2 + abs(o.m22) * (s.z1 - s.z0) / 2 AS hz
    FROM object_node AS o
    JOIN shape AS s ON s.id = o.shape_id
    WHERE o.part_id IS NOT NULL
),
compared AS (
    SELECT
        c.object_id, c.path,
        greatest(
            abs(c.x0 - (c.cx - c.hx)), abs(c.y0 - (c.cy - c.hy)), abs(c.z0 - (c.cz - c.hz)),
            abs(c.x1 - (c.cx + c.hx)), abs(c.y1 - (c.cy + c.hy)), abs(c.z1 - (c.cz + c.hz))
        ) AS difference
    FROM carried AS c
)
SELECT object_id, path, difference
FROM compared
WHERE difference IS NULL OR difference > 1e-6
ORDER BY object_id, path
