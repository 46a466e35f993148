-- How many rows a run has of what a replay reads.
-- Takes run; gives relation and rows.
SELECT 'problem' AS relation, count(*) AS rows FROM problem WHERE run_id = :run
UNION ALL SELECT 'candidate', count(*) FROM candidate WHERE run_id = :run
UNION ALL SELECT 'problem_relation', count(*) FROM problem_relation WHERE run_id = :run
UNION ALL SELECT 'compatibility', count(*) FROM compatibility WHERE run_id = :run
UNION ALL SELECT 'assignment', count(*) FROM assignment WHERE run_id = :run
UNION ALL SELECT 'correspondence', count(*) FROM correspondence WHERE run_id = :run
UNION ALL SELECT 'surface_match', count(*) FROM surface_match WHERE run_id = :run
UNION ALL SELECT 'edge_measurement', count(*) FROM edge_measurement WHERE run_id = :run
UNION ALL SELECT 'solved_pose', count(*) FROM solved_pose WHERE run_id = :run
UNION ALL SELECT 'camera_unknown', count(*) FROM camera_unknown WHERE run_id = :run
UNION ALL SELECT 'hypothesis', count(*) FROM hypothesis WHERE run_id = :run
UNION ALL SELECT 'hypothesis_support', count(*) FROM hypothesis_support WHERE run_id = :run
UNION ALL SELECT 'verdict_sign', count(*) FROM verdict_sign WHERE run_id = :run
UNION ALL SELECT 'threshold', count(*) FROM threshold WHERE run_id = :run
UNION ALL SELECT 'inspection', count(*) FROM inspection WHERE run_id = :run
ORDER BY relation
