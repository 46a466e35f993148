-- What lies in each of some volumes, asked of the files that relmodel export --parquet writes.
-- Takes no parameter but six tables.  Of exports, of one store or of many: world, page, occurrence and element, the
-- folders, with the store_id that names theirs.  Of the asker:
-- asked (volume_no, level: part, feature, surface or arc, bounds x0 .. z1, mm, world; ball_x, ball_y, ball_z,
-- ball_radius: null but for spheres) and asked_half_space (volume_no, outward normal nx, ny, nz and d, inside where
-- n . p <= d; no row for boxes and spheres).
-- Gives store_id, cell, world, volume_no, occurrence_id, element_no (-1 of parts), path, name and the world box x0 .. z1,
-- sorted by store_id, world, volume_no, occurrence_id and element_no: the rows of relmodel.find.find.in_volumes at
-- precision box, for every world of every store.  Numbers of worlds, shapes and occurrences are those of a store.
-- DuckDB and Spark SQL take it as it stands.  To Spark the hint says that the pages met are few, so that it reads only
-- the folders of their page ranges; it looks for those only where the pages are filtered too, hence the box_count.
WITH near AS (
    SELECT a.volume_no, a.level, a.x0, a.y0, a.z0, a.x1, a.y1, a.z1, a.ball_x, a.ball_y, a.ball_z, a.ball_radius,
        p.store_id, p.world_id, p.page_range, p.page
    FROM page AS p
    JOIN asked AS a ON p.x0 <= a.x1 AND p.y0 <= a.y1 AND p.z0 <= a.z1 AND p.x1 >= a.x0 AND p.y1 >= a.y0 AND p.z1 >= a.z0
    WHERE p.box_count > 0
),
met AS (
    SELECT /*+ BROADCAST(n) */ n.volume_no, n.level, n.x0 AS least_x, n.y0 AS least_y, n.z0 AS least_z,
        n.x1 AS most_x, n.y1 AS most_y, n.z1 AS most_z, n.ball_x, n.ball_y, n.ball_z, n.ball_radius,
        o.store_id, o.world_id, o.occurrence_id, o.path, o.name AS part_name, o.shape_id,
        o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
    FROM occurrence AS o
    JOIN near AS n ON n.store_id = o.store_id AND n.world_id = o.world_id AND n.page_range = o.page_range
        AND n.page = o.page
        AND o.x0 <= n.x1 AND o.y0 <= n.y1 AND o.z0 <= n.z1 AND o.x1 >= n.x0 AND o.y1 >= n.y0 AND o.z1 >= n.z0
),
carried AS (
    SELECT m.*, e.element_no, coalesce(e.name, m.part_name) AS name,
        e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0, e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
        least(m.m00 * e.x0, m.m00 * e.x1) + least(m.m01 * e.y0, m.m01 * e.y1)
            + least(m.m02 * e.z0, m.m02 * e.z1) + m.m03 AS x0,
        least(m.m10 * e.x0, m.m10 * e.x1) + least(m.m11 * e.y0, m.m11 * e.y1)
            + least(m.m12 * e.z0, m.m12 * e.z1) + m.m13 AS y0,
        least(m.m20 * e.x0, m.m20 * e.x1) + least(m.m21 * e.y0, m.m21 * e.y1)
            + least(m.m22 * e.z0, m.m22 * e.z1) + m.m23 AS z0,
        greatest(m.m00 * e.x0, m.m00 * e.x1) + greatest(m.m01 * e.y0, m.m01 * e.y1)
            + greatest(m.m02 * e.z0, m.m02 * e.z1) + m.m03 AS x1,
        greatest(m.m10 * e.x0, m.m10 * e.x1) + greatest(m.m11 * e.y0, m.m11 * e.y1)
            + greatest(m.m12 * e.z0, m.m12 * e.z1) + m.m13 AS y1,
        greatest(m.m20 * e.x0, m.m20 * e.x1) + greatest(m.m21 * e.y0, m.m21 * e.y1)
            + greatest(m.m22 * e.z0, m.m22 * e.z1) + m.m23 AS z1,
        m.m00 * (m.ball_x - m.m03) + m.m10 * (m.ball_y - m.m13) + m.m20 * (m.ball_z - m.m23) AS centre_x,
        m.m01 * (m.ball_x - m.m03) + m.m11 * (m.ball_y - m.m13) + m.m21 * (m.ball_z - m.m23) AS centre_y,
        m.m02 * (m.ball_x - m.m03) + m.m12 * (m.ball_y - m.m13) + m.m22 * (m.ball_z - m.m23) AS centre_z
    FROM met AS m
    JOIN element AS e ON e.store_id = m.store_id AND e.shape_id = m.shape_id AND e.level = m.level
)
SELECT w.store_id, w.cell, w.name AS world, c.volume_no, c.occurrence_id, c.element_no, c.path, c.name,
    c.x0, c.y0, c.z0, c.x1, c.y1, c.z1
FROM carried AS c
JOIN world AS w ON w.store_id = c.store_id AND w.world_id = c.world_id
WHERE c.x0 <= c.most_x AND c.y0 <= c.most_y AND c.z0 <= c.most_z
    AND c.x1 >= c.least_x AND c.y1 >= c.least_y AND c.z1 >= c.least_z
    AND (
        c.ball_radius IS NULL
        OR power(greatest(c.shape_x0 - c.centre_x, c.centre_x - c.shape_x1, 0), 2)
            + power(greatest(c.shape_y0 - c.centre_y, c.centre_y - c.shape_y1, 0), 2)
            + power(greatest(c.shape_z0 - c.centre_z, c.centre_z - c.shape_z1, 0), 2) <= c.ball_radius * c.ball_radius
    )
    AND NOT EXISTS (
        SELECT 1
        FROM asked_half_space AS h
        WHERE h.volume_no = c.volume_no
            AND least((h.nx * c.m00 + h.ny * c.m10 + h.nz * c.m20) * c.shape_x0,
                    (h.nx * c.m00 + h.ny * c.m10 + h.nz * c.m20) * c.shape_x1)
                + least((h.nx * c.m01 + h.ny * c.m11 + h.nz * c.m21) * c.shape_y0,
                    (h.nx * c.m01 + h.ny * c.m11 + h.nz * c.m21) * c.shape_y1)
                + least((h.nx * c.m02 + h.ny * c.m12 + h.nz * c.m22) * c.shape_z0,
                    (h.nx * c.m02 + h.ny * c.m12 + h.nz * c.m22) * c.shape_z1)
                + (h.nx * c.m03 + h.ny * c.m13 + h.nz * c.m23) > h.d
    )
ORDER BY store_id, world, volume_no, occurrence_id, element_no
