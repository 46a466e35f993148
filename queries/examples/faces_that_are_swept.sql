-- Which faces of bulkhead are extruded, revolved or offset, from what, along which direction (of extrusion, or axis) or how far, and how large are they?
SELECT h.surface_no, s.kind, coalesce(a.kind, b.kind) AS basis, a.length AS basis_mm,
    w.axis_x, w.axis_y, w.axis_z, w.distance, s.area
FROM placed_part AS p
JOIN shape_surface AS h ON h.shape_id = p.shape_id
JOIN surface AS s ON s.id = h.surface_id
JOIN surface_swept AS w ON w.surface_id = s.id
LEFT JOIN arc AS a ON a.id = w.basis_arc_id
LEFT JOIN surface AS b ON b.id = w.basis_surface_id
WHERE p.object = 'bulkhead' /* object */ AND p.variant = 'A' /* variant */ AND p.object_path = 'BODY' /* part */
ORDER BY s.area DESC, h.surface_no
