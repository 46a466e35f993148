-- What label each unit of a problem was given.
-- Takes run and problem_no; gives label_no, -1 for none, in the order of the units.
SELECT coalesce(label_no, -1) AS label_no
FROM assignment
WHERE run_id = :run AND problem_no = :problem_no
ORDER BY unit_no
