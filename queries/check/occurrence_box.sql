-- Placed parts without a world box, or whose world box is not the box of their shape carried into the world, to 1e-6 mm.
-- Takes nothing; gives occurrence_id, path and the greatest difference of a bound, mm (null: no box).
WITH carried AS (  -- centre and half extent: |R| h bounds the turned box
    SELECT
        o.id, o.path,
        o.m00 * (s.x0 + s.x1) / 2 + o.m01 * (s.y0 + s.y1) / 2 + o.m02 * (s.z0 + s.z1) / 2 + o.m03 AS cx,
        o.m10 * (s.x0 + s.x1) / 2 + o.m11 * (s.y0 + s.y1) / 2 + o.m12 * (s.z0 + s.z1) / 2 + o.m13 AS cy,
        o.m20 * (s.x0 + s.x1) / 2 + o.m21 * (s.y0 + s.y1) / 2 + o.m22 * (s.z0 + s.z1) / 2 + o.m23 AS cz,
        abs(o.m00) * (s.x1 - s.x0) / 2 + abs(o.m01) * (s.y1 - s.y0) / 2 + abs(o.m02) * (s.z1 - s.z0) / 2 AS hx,
        abs(o.m10) * (s.x1 - s.x0) / 2 + abs(o.m11) * (s.y1 - s.y0) / 2 + abs(o.m12) * (s.z1 - s.z0) / 2 AS hy,
        abs(o.m20) * (s.x1 - s.x0) / 2 + abs(o.m21) * (s.y1 - s.y0) / 2 + abs(o.m22) * (s.z1 - s.z0) / 2 AS hz
    FROM occurrence AS o
    JOIN shape AS s ON s.id = o.shape_id
    WHERE o.kind = 'part'
),
compared AS (
    SELECT
        c.id, c.path,
        greatest(
            abs(b.x0 - (c.cx - c.hx)), abs(b.y0 - (c.cy - c.hy)), abs(b.z0 - (c.cz - c.hz)),
            abs(b.x1 - (c.cx + c.hx)), abs(b.y1 - (c.cy + c.hy)), abs(b.z1 - (c.cz + c.hz))
        ) AS difference
    FROM carried AS c
    LEFT JOIN occurrence_box AS b ON b.occurrence_id = c.id
)
SELECT id AS occurrence_id, path, difference
FROM compared
WHERE difference IS NULL OR difference > 1e-6
ORDER BY id
