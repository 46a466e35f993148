-- Takes ids (array) of arcs.  Gives rows of arc_spline, in order of id.
SELECT arc_id AS id, degree, periodic, rational, knots, multiplicities, poles, weights
FROM arc_spline
WHERE arc_id = ANY(:ids)
ORDER BY arc_id
