-- What a verdict weighed, and what it was held against.
-- Takes run; gives what (sign, threshold), name and value.
SELECT 'sign' AS what, name, value FROM verdict_sign WHERE run_id = :run
UNION ALL SELECT 'threshold', name, value FROM threshold WHERE run_id = :run AND decision = 'verdict'
ORDER BY what, name
