-- Parts, to be compared.
-- Takes part_ids (array).  Gives id, number, name, material, colour, attributes (as one text), shape_id and the shape's
-- surface_count, area (mm2), volume (mm3) and box x0 .. z1, in order of id.
SELECT p.id, p.number, p.name, p.material, p.colour,
    (SELECT string_agg(a.name || '=' || coalesce(a.value_text, CAST(a.value_number AS TEXT)), ', ' ORDER BY a.name)
        FROM part_attribute AS a WHERE a.part_id = p.id) AS attributes,
    p.shape_id, s.surface_count, s.area, s.volume, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1
FROM part AS p
JOIN shape AS s ON s.id = p.shape_id
WHERE p.id = ANY(:part_ids)
ORDER BY p.id
