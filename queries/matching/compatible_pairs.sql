-- Pairs of candidates of a problem that confirm each other.
-- Takes run_id, problem_no; gives unit_a, label_a, unit_b, label_b, saves.
SELECT unit_a, label_a, unit_b, label_b, saves
FROM compatibility
WHERE run_id = :run_id AND problem_no = :problem_no
ORDER BY unit_a, label_a, unit_b, label_b
