-- How the occurrences of each object placed in a world lie in its pages.
-- Takes world_id.
-- Gives object_no, occurrences, overflowing (how many of them lie in overflow pages), first_id, last_id, last_page and
-- first_overflow (-1: no page, no overflow page), sorted by object_no.
SELECT o.object_no, count(*) AS occurrences, count(*) FILTER (WHERE p.overflow) AS overflowing,
    min(o.id) AS first_id, max(o.id) AS last_id, coalesce(max(o.page), -1) AS last_page,
    coalesce(min(o.page) FILTER (WHERE p.overflow), -1) AS first_overflow
FROM occurrence AS o
LEFT JOIN box_page AS p ON p.world_id = o.world_id AND p.page = o.page
WHERE o.world_id = :world_id
GROUP BY o.object_no
ORDER BY o.object_no
