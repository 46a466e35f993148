-- Adjacencies that are not those of the arc: its two surfaces in order, its convexity and angle.
-- Takes nothing; gives shape_id and arc_no.
SELECT j.shape_id, j.arc_no
FROM surface_adjacency AS j
JOIN shape_arc AS a ON a.shape_id = j.shape_id AND a.arc_no = j.arc_no
WHERE a.surface_a IS NULL OR a.surface_b IS NULL
    OR j.surface_a <> least(a.surface_a, a.surface_b)
    OR j.surface_b <> greatest(a.surface_a, a.surface_b)
    OR j.convexity <> a.convexity
    OR abs(j.angle - a.angle) > 1e-12
ORDER BY j.shape_id, j.arc_no
