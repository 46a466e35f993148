-- Which convex edges of bulkhead are longer than 500 mm?
SELECT h.arc_no, a.recognised_kind AS kind, a.length
FROM placed_part AS p
JOIN shape_arc AS h ON h.shape_id = p.shape_id AND h.convexity = 'convex'
JOIN arc AS a ON a.id = h.arc_id
WHERE p.object = 'bulkhead' /* object */ AND p.variant = 'A' /* variant */ AND p.object_path = 'BODY' /* part */
    AND a.length > 500 /* length */
ORDER BY a.length DESC, h.arc_no
