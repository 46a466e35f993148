-- Pages of the world's index that are not the union of their boxes, or miscount them.
-- Takes nothing; gives world_id and page.
WITH united AS (
    SELECT
        world_id, page, count(*) AS box_count,
        min(x0) AS x0, min(y0) AS y0, min(z0) AS z0, max(x1) AS x1, max(y1) AS y1, max(z1) AS z1
    FROM occurrence_box
    GROUP BY world_id, page
)
SELECT coalesce(p.world_id, u.world_id) AS world_id, coalesce(p.page, u.page) AS page
FROM box_page AS p
FULL JOIN united AS u ON u.world_id = p.world_id AND u.page = p.page
WHERE p.world_id IS NULL OR u.world_id IS NULL OR p.box_count <> u.box_count
    OR p.x0 <> u.x0 OR p.y0 <> u.y0 OR p.z0 <> u.z0 OR p.x1 <> u.x1 OR p.y1 <> u.y1 OR p.z1 <> u.z1
ORDER BY world_id, page
