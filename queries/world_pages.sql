-- The pages of a world, from the boxes of its placed parts.
-- Takes world_id and first_overflow (the first page that was added after the world was packed).
-- Gives nothing.
INSERT INTO box_page (world_id, page, box_count, overflow, x0, y0, z0, x1, y1, z1)
SELECT o.world_id, o.page, count(*), o.page >= :first_overflow,
    min(o.x0), min(o.y0), min(o.z0), max(o.x1), max(o.y1), max(o.z1)
FROM occurrence AS o
WHERE o.world_id = :world_id AND o.page IS NOT NULL
GROUP BY o.world_id, o.page
ORDER BY o.page
