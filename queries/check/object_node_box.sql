-- Parts of expanded objects without a box, or whose box is not that around the hull of their shape, with what reaches
-- beyond it, carried into the body's frame, or of one without a hull around its box, to 1e-6 mm.
-- Takes nothing; gives object_id, path and the greatest difference of a bound, mm (null: no box).
WITH carried AS (
    SELECT
        o.object_id, o.path, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
        coalesce(hull_back(o.m00, o.m01, o.m02, o.m03, s.hull_x, s.hull_y, s.hull_z) - s.hull_mm,
            reach_back(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1)) AS least_x,
        coalesce(hull_back(o.m10, o.m11, o.m12, o.m13, s.hull_x, s.hull_y, s.hull_z) - s.hull_mm,
            reach_back(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1)) AS least_y,
        coalesce(hull_back(o.m20, o.m21, o.m22, o.m23, s.hull_x, s.hull_y, s.hull_z) - s.hull_mm,
            reach_back(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1)) AS least_z,
        coalesce(hull_forth(o.m00, o.m01, o.m02, o.m03, s.hull_x, s.hull_y, s.hull_z) + s.hull_mm,
            reach_forth(o.m00, o.m01, o.m02, o.m03, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1)) AS most_x,
        coalesce(hull_forth(o.m10, o.m11, o.m12, o.m13, s.hull_x, s.hull_y, s.hull_z) + s.hull_mm,
            reach_forth(o.m10, o.m11, o.m12, o.m13, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1)) AS most_y,
        coalesce(hull_forth(o.m20, o.m21, o.m22, o.m23, s.hull_x, s.hull_y, s.hull_z) + s.hull_mm,
            reach_forth(o.m20, o.m21, o.m22, o.m23, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1)) AS most_z
    FROM object_node AS o
    JOIN shape AS s ON s.id = o.shape_id
    WHERE o.part_id IS NOT NULL
)
SELECT object_id, path, difference
FROM carried AS c
CROSS JOIN LATERAL (
    SELECT greatest(
        abs(c.x0 - c.least_x), abs(c.y0 - c.least_y), abs(c.z0 - c.least_z),
        abs(c.x1 - c.most_x), abs(c.y1 - c.most_y), abs(c.z1 - c.most_z)
    ) AS difference
) AS compared
WHERE difference IS NULL OR difference > 1e-6
ORDER BY object_id, path
