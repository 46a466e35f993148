-- The edge points that measured the pose, and how far each lies from where the pose has it.
-- Takes run_id; gives one row a point, in order: px, weight 0 to 1, world point in mm.
SELECT v.camera, m.u, m.v, m.normal_u, m.normal_v, m.sigma, m.weight, m.residual, m.world_x, m.world_y, m.world_z
FROM edge_measurement AS m
JOIN inspection_image AS v ON v.run_id = m.run_id AND v.view_no = m.view_no
WHERE m.run_id = :run_id
ORDER BY v.camera, m.measurement_no
