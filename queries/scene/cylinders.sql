-- Cylinders among the surfaces of shapes.
-- Takes shape_ids (array); gives one row a surface, in order of shape and surface; radius in mm.
SELECT h.shape_id, h.surface_no, s.radius
FROM shape_surface AS h
JOIN surface AS s ON s.id = h.surface_id
WHERE h.shape_id = ANY(:shape_ids) AND s.recognised_kind = 'cylinder' AND s.radius IS NOT NULL
ORDER BY h.shape_id, h.surface_no
