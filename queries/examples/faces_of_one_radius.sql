-- Which cylindrical faces have a radius of 21 mm?
WITH body AS (
    SELECT shape_id
    FROM placed_part
    WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
)
SELECT h.surface_no, s.origin_x AS x, s.origin_y AS y
FROM body
JOIN shape_surface AS h ON h.shape_id = body.shape_id
JOIN surface AS s ON s.id = h.surface_id
WHERE s.recognised_kind = 'cylinder' AND abs(s.radius - 21 /* radius */) < 1e-3
ORDER BY h.surface_no
