-- Parts, what they are and how large.
-- Takes part_ids (array).  Gives id, number, name, material, colour, supplemental, shape_id, surface_count, volume (mm3)
-- and the sizes of the box, mm, in order of id.
SELECT p.id, p.number, p.name, p.material, p.colour, p.supplemental, p.shape_id, s.surface_count, s.volume,
    s.x1 - s.x0 AS size_x, s.y1 - s.y0 AS size_y, s.z1 - s.z0 AS size_z
FROM part AS p
JOIN shape AS s ON s.id = p.shape_id
WHERE p.id = ANY(:part_ids)
ORDER BY p.id
