-- The point that an inspection measured its pose by, in the mean: what the cameras look at.
-- Takes run_id; gives one row; nulls where nothing was measured.
SELECT avg(world_x) AS x, avg(world_y) AS y, avg(world_z) AS z
FROM edge_measurement
WHERE run_id = :run_id
