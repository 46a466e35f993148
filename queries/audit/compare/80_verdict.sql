-- What the verdict of a run weighed, and what that was compared with.
-- Takes run; gives name and value.
SELECT name, CAST(value AS TEXT) AS value FROM verdict_statistic WHERE run_id = :run
UNION ALL
SELECT concat('needed: ', name), CAST(value AS TEXT) FROM threshold WHERE run_id = :run AND decision = 'verdict'
UNION ALL
SELECT concat('passes ', rule), CASE WHEN holds THEN 'yes' ELSE 'no' END FROM why_verdict WHERE run_id = :run
