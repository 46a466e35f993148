-- Splines of arcs.
-- Takes the relation sought (id); gives rows of arc_spline, in order of id.
SELECT s.arc_id AS id, degree, periodic, rational, knots, multiplicities, poles, weights
FROM sought
JOIN arc_spline AS s ON s.arc_id = sought.id
ORDER BY s.arc_id
