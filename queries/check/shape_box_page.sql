-- Pages of the index inside shapes that are not the union of their boxes, or miscount them.
-- Takes nothing; gives shape_id, level and page.
WITH united AS (
    SELECT
        shape_id, level, page, count(*) AS box_count,
        min(x0) AS x0, min(y0) AS y0, min(z0) AS z0, max(x1) AS x1, max(y1) AS y1, max(z1) AS z1
    FROM shape_box
    GROUP BY shape_id, level, page
)
SELECT coalesce(p.shape_id, u.shape_id) AS shape_id, coalesce(p.level, u.level) AS level, coalesce(p.page, u.page) AS page
FROM shape_box_page AS p
FULL JOIN united AS u ON u.shape_id = p.shape_id AND u.level = p.level AND u.page = p.page
WHERE p.shape_id IS NULL OR u.shape_id IS NULL OR p.box_count <> u.box_count
    OR p.x0 <> u.x0 OR p.y0 <> u.y0 OR p.z0 <> u.z0 OR p.x1 <> u.x1 OR p.y1 <> u.y1 OR p.z1 <> u.z1
ORDER BY shape_id, level, page
