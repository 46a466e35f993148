-- Which cylindrical faces have a radius of 21 mm?
WITH body AS (
    SELECT p.shape_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id
    JOIN part AS p ON p.id = i.part_id
    WHERE v.name = 'bulkhead' /* object */ AND v.variant = 'A' /* variant */ AND i.name = 'BODY' /* part */
    ORDER BY v.revision DESC
    LIMIT 1
)
SELECT h.surface_no, s.origin_x AS x, s.origin_y AS y
FROM body
JOIN shape_surface AS h ON h.shape_id = body.shape_id
JOIN surface AS s ON s.id = h.surface_id
WHERE s.recognised_kind = 'cylinder' AND abs(s.radius - 21 /* radius */) < 1e-3
ORDER BY h.surface_no
