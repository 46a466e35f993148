-- Relations among the units of a problem.
-- Takes run_id, problem_no; gives unit_no, neighbour_no, weight.
SELECT unit_no, neighbour_no, weight
FROM problem_relation
WHERE run_id = :run_id AND problem_no = :problem_no
ORDER BY unit_no, neighbour_no
