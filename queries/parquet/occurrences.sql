-- Placed parts of some pages of a world.
-- Takes world_id, first_page and last_page, numbered as in parquet/pages; gives page, occurrence_id, path, name of the
-- part, shape_id, the world box x0 .. z1 and world_from_occurrence m00 .. m23, sorted by page and occurrence_id.
WITH page AS (
    SELECT w.object_no, g.page AS own_page, row_number() OVER (ORDER BY w.object_no, g.page) - 1 AS page
    FROM world_object AS w
    JOIN object_page AS g ON g.object_id = w.object_id
    WHERE w.world_id = :world_id
)
SELECT p.page, o.id AS occurrence_id, o.path, part.name, o.shape_id,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM page AS p
JOIN occurrence AS o ON o.object_no = p.object_no AND o.page = p.own_page
JOIN part ON part.id = o.part_id
WHERE o.world_id = :world_id AND p.page BETWEEN :first_page AND :last_page
ORDER BY p.page, o.id
