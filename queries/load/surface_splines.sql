-- Takes ids (array) of surfaces.  Gives rows of surface_spline, in order of id.
SELECT surface_id AS id, u_degree, v_degree, u_periodic, v_periodic, rational, u_knots, u_multiplicities, v_knots,
    v_multiplicities, u_poles, v_poles, poles, weights
FROM surface_spline
WHERE surface_id = ANY(:ids)
ORDER BY surface_id
