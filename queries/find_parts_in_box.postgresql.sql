-- Placed parts whose world box meets a box, touching counts.
-- Takes x0, y0, z0, x1, y1, z1 (mm, world) and world_id.
-- Gives the columns of find_parts_in_boxes but volume_no, in no order: to sort a few rows here takes longer.
-- Pages first: the index of occurrence is by page.
SELECT o.id AS occurrence_id, o.shape_id, -1 AS element_no, o.path, part.name,
    o.x0, o.y0, o.z0, o.x1, o.y1, o.z1,
    s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM box_page AS p
JOIN occurrence AS o ON o.world_id = p.world_id AND o.page = p.page
JOIN part ON part.id = o.part_id
JOIN shape AS s ON s.id = o.shape_id
WHERE p.world_id = :world_id
    AND p.x0 <= :x1 AND p.y0 <= :y1 AND p.z0 <= :z1 AND p.x1 >= :x0 AND p.y1 >= :y0 AND p.z1 >= :z0
    AND o.x0 <= :x1 AND o.y0 <= :y1 AND o.z0 <= :z1 AND o.x1 >= :x0 AND o.y1 >= :y0 AND o.z1 >= :z0
