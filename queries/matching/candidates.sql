-- Candidates of a problem.
-- Takes run_id, problem_no; gives unit_no, label_no, cost.
SELECT unit_no, label_no, cost
FROM candidate
WHERE run_id = :run_id AND problem_no = :problem_no
ORDER BY unit_no, label_no
