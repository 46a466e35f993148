-- Parts, what they are and how large.
-- Takes part_ids (array); gives id, number, name, material, colour, mass (kg, where the density is known), shape_id,
-- surface_count, arc_count, volume (mm3) and the sizes of the box, mm, in order of id.
SELECT p.id, p.number, p.name, m.value_text AS material, c.value_text AS colour, w.mass, p.shape_id,
    s.surface_count, s.arc_count, s.volume, s.x1 - s.x0 AS size_x, s.y1 - s.y0 AS size_y, s.z1 - s.z0 AS size_z
FROM part AS p
JOIN shape AS s ON s.id = p.shape_id
LEFT JOIN current_part_attribute AS m ON m.part_id = p.id AND m.name = 'material'
LEFT JOIN current_part_attribute AS c ON c.part_id = p.id AND c.name = 'colour'
LEFT JOIN part_mass AS w ON w.part_id = p.id
WHERE p.id = ANY(:part_ids)
ORDER BY p.id
