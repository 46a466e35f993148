-- Delete what struck candidates of a problem would confirm.
-- Takes run_id, problem_no, and struck (unit_no, label_no) as a relation; gives nothing.
DELETE FROM compatibility
WHERE run_id = :run_id AND problem_no = :problem_no
    AND EXISTS (
        SELECT 1 FROM struck AS s
        WHERE (s.unit_no = compatibility.unit_a AND s.label_no = compatibility.label_a)
            OR (s.unit_no = compatibility.unit_b AND s.label_no = compatibility.label_b)
    )
