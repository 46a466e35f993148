-- Pages of expanded objects that are not the union of their boxes, or miscount them.
-- Takes nothing; gives object_id and page.
WITH united AS (
    SELECT
        object_id, page, body_no, count(*) AS box_count,
        min(x0) AS x0, min(y0) AS y0, min(z0) AS z0, max(x1) AS x1, max(y1) AS y1, max(z1) AS z1
    FROM object_node
    WHERE part_id IS NOT NULL
    GROUP BY object_id, page, body_no
)
SELECT coalesce(p.object_id, u.object_id) AS object_id, coalesce(p.page, u.page) AS page
FROM object_page AS p
FULL JOIN united AS u ON u.object_id = p.object_id AND u.page = p.page AND u.body_no = p.body_no
WHERE p.object_id IS NULL OR u.object_id IS NULL OR p.box_count <> u.box_count
    OR p.x0 <> u.x0 OR p.y0 <> u.y0 OR p.z0 <> u.z0 OR p.x1 <> u.x1 OR p.y1 <> u.y1 OR p.z1 <> u.z1
ORDER BY object_id, page
