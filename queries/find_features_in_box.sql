-- Features of placed parts whose world box meets a box, touching counts.
-- Takes x0, y0, z0, x1, y1, z1 (mm, world) and world, a name.
-- Gives occurrence_id, shape_id, element_no, path of the part, name, the world box x0 .. z1, the box in the shape's
-- frame shape_x0 .. shape_z1 and world_from_occurrence m00 .. m23, sorted by occurrence_id, element_no.
SELECT h.occurrence_id, o.shape_id, h.feature_no AS element_no, h.path, h.name,
    h.x0, h.y0, h.z0, h.x1, h.y1, h.z1,
    e.x0 AS shape_x0, e.y0 AS shape_y0, e.z0 AS shape_z0, e.x1 AS shape_x1, e.y1 AS shape_y1, e.z1 AS shape_z1,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23
FROM features_in_box(:x0, :y0, :z0, :x1, :y1, :z1, :world) AS h
JOIN occurrence AS o ON o.id = h.occurrence_id
JOIN shape_box AS e ON e.shape_id = o.shape_id AND e.level = 'feature' AND e.element_no = h.feature_no
ORDER BY h.occurrence_id, h.feature_no
