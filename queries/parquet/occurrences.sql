-- Placed parts of some pages of a world.
-- Takes world_id, first_page and last_page.
-- Gives page, occurrence_id, path, name of the part, shape_id, the world box x0 .. z1 and world_from_occurrence
-- m00 .. m23, sorted by page and occurrence_id.
SELECT o.page, o.id AS occurrence_id, o.path, part.name, o.shape_id,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM occurrence AS o
JOIN part ON part.id = o.part_id
WHERE o.world_id = :world_id AND o.page BETWEEN :first_page AND :last_page
ORDER BY o.page, o.id
