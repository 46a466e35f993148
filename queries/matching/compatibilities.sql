-- Append the pairs of candidates of a problem that confirm each other, once its relations are there.
-- Takes run_id, problem_no; appends to compatibility.
INSERT INTO compatibility (run_id, problem_no, unit_a, label_a, unit_b, label_b, saves)
SELECT run_id, problem_no, unit_a, label_a, unit_b, label_b, saves
FROM due_compatibility
WHERE run_id = :run_id AND problem_no = :problem_no
