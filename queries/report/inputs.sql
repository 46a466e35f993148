-- The files that a run read.
-- Takes run_id; gives one row an input, in order.
SELECT role, name, sha256
FROM run_input
WHERE run_id = :run_id
ORDER BY input_no
