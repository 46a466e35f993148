-- A matching problem.
-- Takes run_id, problem_no; gives no row or one: kind, method, units_id, labels_id, injective, status, cost, bound.
SELECT kind, method, units_id, labels_id, injective, status, cost, bound
FROM problem
WHERE run_id = :run_id AND problem_no = :problem_no
