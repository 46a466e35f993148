-- Splines of surfaces.
-- Takes the relation sought (id); gives rows of surface_spline, in order of id.
SELECT s.surface_id AS id, u_degree, v_degree, u_periodic, v_periodic, rational, u_knots, u_multiplicities, v_knots,
    v_multiplicities, u_poles, v_poles, poles, weights
FROM sought
JOIN surface_spline AS s ON s.surface_id = sought.id
ORDER BY s.surface_id
