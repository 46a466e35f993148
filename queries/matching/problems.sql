-- Matching problems whose proof is kept.
-- Takes nothing; gives run_id, problem_no, kind, method.
SELECT run_id, problem_no, kind, method
FROM problem
WHERE dual_scale IS NOT NULL
ORDER BY run_id, problem_no
