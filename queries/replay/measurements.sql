-- What a pose was measured with.
-- Takes run; gives the columns of edge_measurement but for run_id, in their order.
SELECT view_no, world_x, world_y, world_z, normal_u, normal_v, u, v, sigma, weight, residual, response, tolerance, arc_shift,
    scene_arc, stretch, length
FROM edge_measurement
WHERE run_id = :run
ORDER BY view_no, measurement_no
