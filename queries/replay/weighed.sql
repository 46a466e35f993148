-- What a verdict weighed, and what it was compared with.
-- Takes run; gives what (statistic, threshold), name and value.
SELECT 'statistic' AS what, name, value FROM verdict_statistic WHERE run_id = :run
UNION ALL SELECT 'threshold', name, value FROM threshold WHERE run_id = :run AND decision = 'verdict'
ORDER BY what, name
