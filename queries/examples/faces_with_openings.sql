-- Which faces of bulkhead have openings in them, how many, and how long is the edge of all of them?
SELECT h.surface_no, s.recognised_kind AS kind, count(DISTINCT l.loop_no) AS openings, sum(a.length) AS edge_mm
FROM placed_part AS p
JOIN shape_surface AS h ON h.shape_id = p.shape_id
JOIN surface AS s ON s.id = h.surface_id
JOIN loop AS l ON l.surface_id = s.id AND NOT l.outer_loop
JOIN coedge AS c ON c.surface_id = l.surface_id AND c.loop_no = l.loop_no
JOIN arc AS a ON a.id = c.arc_id
WHERE p.object = 'bulkhead' /* object */ AND p.variant = 'A' /* variant */ AND p.object_path = 'BODY' /* part */
GROUP BY h.surface_no, s.recognised_kind
ORDER BY openings DESC, h.surface_no
