-- Which plane faces lie at z = 60, and how large are they?
WITH body AS (
    SELECT shape_id
    FROM placed_part
    WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
)
SELECT h.surface_no, s.area
FROM body
JOIN shape_surface AS h ON h.shape_id = body.shape_id
JOIN surface AS s ON s.id = h.surface_id
WHERE s.recognised_kind = 'plane' AND abs(s.axis_z_z) > 1 - 1e-9 AND abs(s.origin_z - 60 /* z */) < 1e-6
ORDER BY s.area DESC, h.surface_no
