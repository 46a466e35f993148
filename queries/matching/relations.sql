-- Append the relations of a problem's units that have candidates.
-- Takes run_id, problem_no; appends to problem_relation.
INSERT INTO problem_relation (run_id, problem_no, unit_no, neighbour_no, weight)
SELECT run_id, problem_no, unit_no, neighbour_no, weight
FROM due_relation
WHERE run_id = :run_id AND problem_no = :problem_no
