-- What it costs each unit of a problem to have no label.
-- Takes run_id, problem_no; gives unit_no, null_cost.
SELECT unit_no, null_cost
FROM assignment
WHERE run_id = :run_id AND problem_no = :problem_no
ORDER BY unit_no
