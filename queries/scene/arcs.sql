-- Sampled arcs of shapes that separate two surfaces or end one: those that can show as an edge.
-- Takes shape_ids (array); gives one row an arc, in order of shape and arc_no, with the numbers of its surfaces (NULL:
-- none).
SELECT s.shape_id, s.arc_no, a.surface_a, a.surface_b,
    s.sample_count, s.points, s.tangents, s.normals_a, s.normals_b
FROM shape_arc_sample AS s
JOIN shape_arc AS a ON a.shape_id = s.shape_id AND a.arc_no = s.arc_no
WHERE s.shape_id = ANY(:shape_ids) AND a.convexity IN ('convex', 'concave', 'smooth', 'free')
ORDER BY s.shape_id, s.arc_no
