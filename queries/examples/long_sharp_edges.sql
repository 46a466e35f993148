-- Which convex edges are longer than 500 mm?
WITH body AS (
    SELECT p.shape_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id
    JOIN part AS p ON p.id = i.part_id
    WHERE v.name = 'bulkhead' /* object */ AND v.variant = 'A' /* variant */ AND i.name = 'BODY' /* part */
    ORDER BY v.revision DESC
    LIMIT 1
)
SELECT h.arc_no, a.recognised_kind AS kind, a.length
FROM body
JOIN shape_arc AS h ON h.shape_id = body.shape_id AND h.convexity = 'convex'
JOIN arc AS a ON a.id = h.arc_id
WHERE a.length > 500 /* length */
ORDER BY a.length DESC, h.arc_no
