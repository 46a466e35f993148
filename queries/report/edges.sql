-- Points along the sharp edges of shapes, to be drawn.
-- Takes shape_ids (array); gives one row an edge, in order of shape and arc; x y z after each other, mm.
SELECT s.shape_id, s.points
FROM shape_arc_sample AS s
JOIN shape_arc AS h ON h.shape_id = s.shape_id AND h.arc_no = s.arc_no
WHERE s.shape_id = ANY(:shape_ids) AND h.convexity IN ('convex', 'concave', 'free')
ORDER BY s.shape_id, s.arc_no
