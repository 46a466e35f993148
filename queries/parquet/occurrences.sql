-- Placed parts of some pages of a world.
-- Takes world_id, first_page and last_page.
-- Gives page, occurrence_id, path, name of the part, shape_id, the world box x0 .. z1 and world_from_occurrence
-- m00 .. m23, sorted by page and occurrence_id.
SELECT b.page, b.occurrence_id, o.path, part.name, o.shape_id,
    b.x0, b.y0, b.z0, b.x1, b.y1, b.z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM occurrence_box AS b
JOIN occurrence AS o ON o.id = b.occurrence_id
JOIN part ON part.id = o.part_id
WHERE b.world_id = :world_id AND b.page BETWEEN :first_page AND :last_page
ORDER BY b.page, b.occurrence_id
