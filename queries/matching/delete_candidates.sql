-- Delete candidates of a problem.
-- Takes run_id, problem_no, and struck (unit_no, label_no) as a relation; gives nothing.
DELETE FROM candidate
WHERE run_id = :run_id AND problem_no = :problem_no
    AND EXISTS (SELECT 1 FROM struck AS s WHERE s.unit_no = candidate.unit_no AND s.label_no = candidate.label_no)
