-- What is not as modelled, each physical thing once, the worst first.
-- Takes run_id; gives one row a finding.
SELECT *
FROM finding
WHERE run_id = :run_id
ORDER BY finding_no
