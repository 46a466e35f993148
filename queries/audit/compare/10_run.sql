-- How a run ended.
-- Takes run; gives name and value.
SELECT 'kind' AS name, kind AS value FROM run_summary WHERE run_id = :run
UNION ALL SELECT 'state', state FROM run_summary WHERE run_id = :run
UNION ALL SELECT 'verdict', verdict FROM run_summary WHERE run_id = :run
UNION ALL SELECT 'outcome', outcome FROM run_summary WHERE run_id = :run
UNION ALL SELECT 'message', message FROM run_summary WHERE run_id = :run
