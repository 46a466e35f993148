-- Surfaces of shapes.
-- Takes shape_ids (array); gives shape_id, surface_no and the columns of surface, sorted.
SELECT h.shape_id, h.surface_no, h.name, s.kind, s.recognised_kind,
    s.origin_x, s.origin_y, s.origin_z, s.axis_x_x, s.axis_x_y, s.axis_x_z, s.axis_z_x, s.axis_z_y, s.axis_z_z,
    s.radius, s.radius2, s.semi_angle, s.area, s.centroid_x, s.centroid_y, s.centroid_z,
    s.x0, s.y0, s.z0, s.x1, s.y1, s.z1, s.provenance
FROM shape_surface AS h
JOIN surface AS s ON s.id = h.surface_id
WHERE h.shape_id = ANY(:shape_ids)
ORDER BY h.shape_id, h.surface_no
