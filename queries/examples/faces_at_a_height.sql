-- Which plane faces lie at z = 60, and how large are they?
WITH body AS (
    SELECT p.shape_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id
    JOIN part AS p ON p.id = i.part_id
    WHERE v.name = 'bulkhead' /* object */ AND v.variant = 'A' /* variant */ AND i.name = 'BODY' /* part */
    ORDER BY v.revision DESC
    LIMIT 1
)
SELECT h.surface_no, s.area
FROM body
JOIN shape_surface AS h ON h.shape_id = body.shape_id
JOIN surface AS s ON s.id = h.surface_id
WHERE s.recognised_kind = 'plane' AND abs(s.axis_z_z) > 1 - 1e-9 AND abs(s.origin_z - 60 /* z */) < 1e-6
ORDER BY s.area DESC, h.surface_no
