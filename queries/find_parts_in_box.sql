-- Placed parts whose world box meets a box, touching counts.
-- Takes x0, y0, z0, x1, y1, z1 (mm, world) and world, a name.
-- Gives occurrence_id, shape_id, element_no (-1), path, name, the world box x0 .. z1, the box of the shape in its own
-- frame shape_x0 .. shape_z1 and world_from_occurrence m00 .. m23, sorted by occurrence_id.
SELECT h.occurrence_id, o.shape_id, -1 AS element_no, h.path, h.name,
    h.x0, h.y0, h.z0, h.x1, h.y1, h.z1,
    s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM parts_in_box(:x0, :y0, :z0, :x1, :y1, :z1, :world) AS h
JOIN occurrence AS o ON o.id = h.occurrence_id
JOIN shape AS s ON s.id = o.shape_id
ORDER BY h.occurrence_id
