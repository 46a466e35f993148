-- Pages of the placed parts of a world.
-- Takes world_id.  Gives page, box_count and the box x0 .. z1 around its boxes, sorted by page.
SELECT page, box_count, x0, y0, z0, x1, y1, z1
FROM box_page
WHERE world_id = :world_id
ORDER BY page
