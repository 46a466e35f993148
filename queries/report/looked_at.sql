-- The middle of the edge points that measured the pose.
-- Takes run_id; gives one row, of nulls where there are none; mm.
SELECT avg(world_x) AS x, avg(world_y) AS y, avg(world_z) AS z
FROM edge_measurement
WHERE run_id = :run_id
