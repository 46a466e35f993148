-- Which convex edges are longer than 500 mm?
WITH body AS (
    SELECT shape_id
    FROM placed_part
    WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
)
SELECT h.arc_no, a.recognised_kind AS kind, a.length
FROM body
JOIN shape_arc AS h ON h.shape_id = body.shape_id AND h.convexity = 'convex'
JOIN arc AS a ON a.id = h.arc_id
WHERE a.length > 500 /* length */
ORDER BY a.length DESC, h.arc_no
