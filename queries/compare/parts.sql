-- Parts, to be compared.
-- Takes part_ids (array); gives id, number, name, material, colour, attributes (as one text) as the file states them,
-- since a comparison of two revisions is made once, shape_id and the shape's surface_count, area (mm2), volume (mm3)
-- and box x0 .. z1, in order of id.
SELECT p.id, p.number, p.name, a.material, a.colour, a.attributes,
    p.shape_id, s.surface_count, s.area, s.volume, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1
FROM part AS p
JOIN shape AS s ON s.id = p.shape_id
LEFT JOIN (
    SELECT part_id,
        min(value_text) FILTER (WHERE name = 'material') AS material,
        min(value_text) FILTER (WHERE name = 'colour') AS colour,
        string_agg(
            name || '=' || coalesce(value_text, CAST(value_number AS TEXT), CAST(value_boolean AS TEXT)), ', ' ORDER BY name
        ) FILTER (WHERE name NOT IN ('material', 'colour')) AS attributes
    FROM part_attribute
    WHERE source = 'file'
    GROUP BY part_id
) AS a ON a.part_id = p.id
WHERE p.id = ANY(:part_ids)
ORDER BY p.id
