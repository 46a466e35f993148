-- Knots and poles of arcs.
-- Takes arc_ids (array); gives rows of arc_spline, in order of arc_id.
SELECT arc_id, degree, periodic, knots, multiplicities, poles, weights
FROM arc_spline
WHERE arc_id = ANY(:arc_ids)
ORDER BY arc_id
