-- Surfaces of a shape, to be compared.
-- Takes shape_id; gives the columns of surface that say where it is, surface_no and label (name, colour and layer in
-- the file, as one text), in order of surface_no.
SELECT h.surface_no, h.surface_id, s.support_key, s.recognised_kind,
    s.origin_x, s.origin_y, s.origin_z, s.axis_z_x, s.axis_z_y, s.axis_z_z, s.radius, s.radius2, s.semi_angle,
    s.direct, s.reversed, s.area, s.centroid_x, s.centroid_y, s.centroid_z,
    coalesce(h.name, '') || '|' || coalesce(a.attributes, '') AS label
FROM shape_surface AS h
JOIN surface AS s ON s.id = h.surface_id
LEFT JOIN (
    SELECT surface_no, string_agg(name || '=' || value_text, '|' ORDER BY name) AS attributes
    FROM surface_attribute
    WHERE shape_id = :shape_id AND source = 'file'
    GROUP BY surface_no
) AS a ON a.surface_no = h.surface_no
WHERE h.shape_id = :shape_id
ORDER BY h.surface_no
