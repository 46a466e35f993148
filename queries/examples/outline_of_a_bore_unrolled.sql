-- From where to where on the flat do the edges of the wall of the first bore of 42 mm run when it is unrolled, in their order, mm?
WITH body AS (
    SELECT shape_id
    FROM placed_part
    WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
),
bore AS (
    SELECT h.surface_no, s.id AS surface_id, s.radius
    FROM body
    JOIN shape_surface AS h ON h.shape_id = body.shape_id
    JOIN surface AS s ON s.id = h.surface_id AND s.kind = 'cylinder' AND abs(2 * s.radius - 42 /* diameter */) < 1e-3
    ORDER BY h.surface_no
    LIMIT 1
)
SELECT b.surface_no, p.loop_no, p.coedge_no,
    b.radius * (p.origin_u + p.axis_u * CASE WHEN c.reversed THEN p.t1 ELSE p.t0 END) AS from_around,
    p.origin_v + p.axis_v * CASE WHEN c.reversed THEN p.t1 ELSE p.t0 END AS from_along,
    b.radius * (p.origin_u + p.axis_u * CASE WHEN c.reversed THEN p.t0 ELSE p.t1 END) AS to_around,
    p.origin_v + p.axis_v * CASE WHEN c.reversed THEN p.t0 ELSE p.t1 END AS to_along
FROM bore AS b
JOIN pcurve AS p ON p.surface_id = b.surface_id AND p.kind = 'line'
JOIN coedge AS c ON c.surface_id = p.surface_id AND c.loop_no = p.loop_no AND c.coedge_no = p.coedge_no
ORDER BY p.loop_no, p.coedge_no
