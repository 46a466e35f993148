-- Arcs of shapes.
-- Takes shape_ids (array); gives shape_id, arc_no, the surfaces on either side and the columns of arc, sorted.
SELECT h.shape_id, h.arc_no, coalesce(h.surface_a, -1) AS surface_a, coalesce(h.surface_b, -1) AS surface_b,
    h.convexity, h.angle, a.kind, a.recognised_kind,
    a.origin_x, a.origin_y, a.origin_z, a.axis_x_x, a.axis_x_y, a.axis_x_z, a.axis_z_x, a.axis_z_y, a.axis_z_z,
    a.radius, a.radius2, a.t0, a.t1, a.start_x, a.start_y, a.start_z, a.end_x, a.end_y, a.end_z, a.length, a.provenance
FROM shape_arc AS h
JOIN arc AS a ON a.id = h.arc_id
WHERE h.shape_id = ANY(:shape_ids)
ORDER BY h.shape_id, h.arc_no
