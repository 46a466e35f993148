-- Pages of the placed parts of a world: those of each placed object after those of the one before.
-- Takes world_id; gives page, box_count and the box x0 .. z1 around its boxes in the world, sorted by page.
SELECT row_number() OVER (ORDER BY object_no, page) - 1 AS page, count(*) AS box_count,
    min(x0) AS x0, min(y0) AS y0, min(z0) AS z0, max(x1) AS x1, max(y1) AS y1, max(z1) AS z1
FROM occurrence
WHERE world_id = :world_id AND kind = 'part'
GROUP BY object_no, page
ORDER BY 1
