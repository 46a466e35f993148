-- What lies in each of some volumes, asked of the files that relmodel export --parquet writes.
-- Takes no parameter but eight tables.  Of exports, of one store or of many: world, placed_body, object_page,
-- object_node, element and hull, the folders, with the store_id that names theirs.  Of the asker: asked (volume_no, level:
-- part, feature, surface or arc, bounds x0 .. z1, mm, world; ball_x, ball_y, ball_z, ball_radius: null but for spheres)
-- and asked_half_space (volume_no, outward normal nx, ny, nz and d, inside where n . p <= d; no row for boxes and
-- spheres).
-- Gives store_id, cell, world, volume_no, occurrence_id, element_no (-1 of parts), path, name and the world box x0 ..
-- z1, sorted by store_id, world, volume_no, occurrence_id and element_no: the rows of relmodel.find.find.in_volumes at
-- precision box, for the newest revision of every world of every store.  Numbers of objects, shapes and occurrences are
-- those of a store. DuckDB and Spark SQL take it as it stands.  To Spark the hint says that the pages met are few, so
-- that it reads only the folders of their page ranges; it looks for those only where what it joins them with is
-- filtered, hence the a.x0 <= a.x1, and not where that filter is one of pages, bodies or shapes, whose folders it would
-- look for first.
WITH near AS (  -- pages whose box, carried into the world, meets the volume's
    SELECT a.*, b.store_id, b.world, b.name AS object_name, b.object_no, b.object_id,
        b.m00, b.m01, b.m02, b.m03, b.m10, b.m11, b.m12, b.m13, b.m20, b.m21, b.m22, b.m23,
        p.page_range, p.page
    FROM placed_body AS b
    JOIN (
        SELECT store_id, object_id, body_no, page_range, page, (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z,
            (x1 - x0) / 2 + 1e-6 AS half_x, (y1 - y0) / 2 + 1e-6 AS half_y, (z1 - z0) / 2 + 1e-6 AS half_z
        FROM object_page
    ) AS p ON p.store_id = b.store_id AND p.object_id = b.object_id AND p.body_no = b.body_no
    JOIN asked AS a ON b.x0 <= a.x1 AND b.y0 <= a.y1 AND b.z0 <= a.z1 AND b.x1 >= a.x0 AND b.y1 >= a.y0 AND b.z1 >= a.z0
        AND abs(b.m00 * p.x + b.m01 * p.y + b.m02 * p.z + b.m03 - (a.x0 + a.x1) / 2)
            <= abs(b.m00) * p.half_x + abs(b.m01) * p.half_y + abs(b.m02) * p.half_z + (a.x1 - a.x0) / 2
        AND abs(b.m10 * p.x + b.m11 * p.y + b.m12 * p.z + b.m13 - (a.y0 + a.y1) / 2)
            <= abs(b.m10) * p.half_x + abs(b.m11) * p.half_y + abs(b.m12) * p.half_z + (a.y1 - a.y0) / 2
        AND abs(b.m20 * p.x + b.m21 * p.y + b.m22 * p.z + b.m23 - (a.z0 + a.z1) / 2)
            <= abs(b.m20) * p.half_x + abs(b.m21) * p.half_y + abs(b.m22) * p.half_z + (a.z1 - a.z0) / 2
    WHERE b.last_revision IS NULL AND a.x0 <= a.x1
),
posed AS (  -- parts whose box in the body's frame, carried into the world, meets the volume's
    SELECT /*+ BROADCAST(b) */ b.volume_no, b.level, b.x0 AS least_x, b.y0 AS least_y, b.z0 AS least_z,
        b.x1 AS most_x, b.y1 AS most_y, b.z1 AS most_z, b.ball_x, b.ball_y, b.ball_z, b.ball_radius,
        b.store_id, b.world, CAST(b.object_no AS BIGINT) * 268435456 + n.node_no AS occurrence_id,
        b.object_name || n.path AS path, n.name AS part_name, n.shape_id,
        b.m00 * n.m00 + b.m01 * n.m10 + b.m02 * n.m20 AS m00,
        b.m00 * n.m01 + b.m01 * n.m11 + b.m02 * n.m21 AS m01,
        b.m00 * n.m02 + b.m01 * n.m12 + b.m02 * n.m22 AS m02,
        b.m00 * n.m03 + b.m01 * n.m13 + b.m02 * n.m23 + b.m03 AS m03,
        b.m10 * n.m00 + b.m11 * n.m10 + b.m12 * n.m20 AS m10,
        b.m10 * n.m01 + b.m11 * n.m11 + b.m12 * n.m21 AS m11,
        b.m10 * n.m02 + b.m11 * n.m12 + b.m12 * n.m22 AS m12,
        b.m10 * n.m03 + b.m11 * n.m13 + b.m12 * n.m23 + b.m13 AS m13,
        b.m20 * n.m00 + b.m21 * n.m10 + b.m22 * n.m20 AS m20,
        b.m20 * n.m01 + b.m21 * n.m11 + b.m22 * n.m21 AS m21,
        b.m20 * n.m02 + b.m21 * n.m12 + b.m22 * n.m22 AS m22,
        b.m20 * n.m03 + b.m21 * n.m13 + b.m22 * n.m23 + b.m23 AS m23
    FROM object_node AS n
    JOIN near AS b ON b.store_id = n.store_id AND b.page_range = n.page_range AND b.object_id = n.object_id
        AND b.page = n.page
        AND abs(b.m00 * (n.x0 + n.x1) / 2 + b.m01 * (n.y0 + n.y1) / 2 + b.m02 * (n.z0 + n.z1) / 2 + b.m03 - (b.x0 + b.x1) / 2)
            <= (abs(b.m00) * (n.x1 - n.x0) + abs(b.m01) * (n.y1 - n.y0) + abs(b.m02) * (n.z1 - n.z0) + b.x1 - b.x0) / 2
                + 1e-6
        AND abs(b.m10 * (n.x0 + n.x1) / 2 + b.m11 * (n.y0 + n.y1) / 2 + b.m12 * (n.z0 + n.z1) / 2 + b.m13 - (b.y0 + b.y1) / 2)
            <= (abs(b.m10) * (n.x1 - n.x0) + abs(b.m11) * (n.y1 - n.y0) + abs(b.m12) * (n.z1 - n.z0) + b.y1 - b.y0) / 2
                + 1e-6
        AND abs(b.m20 * (n.x0 + n.x1) / 2 + b.m21 * (n.y0 + n.y1) / 2 + b.m22 * (n.z0 + n.z1) / 2 + b.m23 - (b.z0 + b.z1) / 2)
            <= (abs(b.m20) * (n.x1 - n.x0) + abs(b.m21) * (n.y1 - n.y0) + abs(b.m22) * (n.z1 - n.z0) + b.z1 - b.z0) / 2
                + 1e-6
),
hulled AS (  -- the boxes around the placed hulls
    SELECT m.store_id, m.volume_no, m.occurrence_id,
        min(m.m00 * h.x + m.m01 * h.y + m.m02 * h.z + m.m03 - h.beyond_mm) AS hull_x0,
        min(m.m10 * h.x + m.m11 * h.y + m.m12 * h.z + m.m13 - h.beyond_mm) AS hull_y0,
        min(m.m20 * h.x + m.m21 * h.y + m.m22 * h.z + m.m23 - h.beyond_mm) AS hull_z0,
        max(m.m00 * h.x + m.m01 * h.y + m.m02 * h.z + m.m03 + h.beyond_mm) AS hull_x1,
        max(m.m10 * h.x + m.m11 * h.y + m.m12 * h.z + m.m13 + h.beyond_mm) AS hull_y1,
        max(m.m20 * h.x + m.m21 * h.y + m.m22 * h.z + m.m23 + h.beyond_mm) AS hull_z1
    FROM posed AS m
    JOIN hull AS h ON h.store_id = m.store_id AND h.shape_id = m.shape_id
    GROUP BY m.store_id, m.volume_no, m.occurrence_id
),
carried AS (
    SELECT m.*, h.hull_x0, h.hull_y0, h.hull_z0, h.hull_x1, h.hull_y1, h.hull_z1, e.element_no, coalesce(e.name, m.part_name) AS name,
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
    FROM posed AS m
    LEFT JOIN hulled AS h ON h.store_id = m.store_id AND h.volume_no = m.volume_no AND h.occurrence_id = m.occurrence_id
    JOIN element AS e ON e.store_id = m.store_id AND e.shape_id = m.shape_id AND e.level = m.level
)
SELECT w.store_id, w.cell, w.name AS world, c.volume_no, c.occurrence_id, c.element_no, c.path, c.name,
    CASE WHEN c.element_no >= 0 THEN c.x0 ELSE greatest(c.x0, c.hull_x0) END AS x0,
    CASE WHEN c.element_no >= 0 THEN c.y0 ELSE greatest(c.y0, c.hull_y0) END AS y0,
    CASE WHEN c.element_no >= 0 THEN c.z0 ELSE greatest(c.z0, c.hull_z0) END AS z0,
    CASE WHEN c.element_no >= 0 THEN c.x1 ELSE least(c.x1, c.hull_x1) END AS x1,
    CASE WHEN c.element_no >= 0 THEN c.y1 ELSE least(c.y1, c.hull_y1) END AS y1,
    CASE WHEN c.element_no >= 0 THEN c.z1 ELSE least(c.z1, c.hull_z1) END AS z1
FROM carried AS c
JOIN world AS w ON w.store_id = c.store_id AND w.name = c.world AND w.newest
WHERE c.x0 <= c.most_x AND c.y0 <= c.most_y AND c.z0 <= c.most_z
    AND c.x1 >= c.least_x AND c.y1 >= c.least_y AND c.z1 >= c.least_z
    AND (
        c.hull_x0 IS NULL
        OR c.hull_x0 <= c.most_x AND c.hull_y0 <= c.most_y AND c.hull_z0 <= c.most_z
            AND c.hull_x1 >= c.least_x AND c.hull_y1 >= c.least_y AND c.hull_z1 >= c.least_z
    )
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
