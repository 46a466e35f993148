-- How a run ended.
-- Takes run; gives name and value.
WITH ended AS MATERIALIZED (SELECT kind, state, verdict, outcome, message FROM run_summary WHERE run_id = :run)
SELECT 'kind' AS name, kind AS value FROM ended
UNION ALL SELECT 'state', state FROM ended
UNION ALL SELECT 'verdict', verdict FROM ended
UNION ALL SELECT 'outcome', outcome FROM ended
UNION ALL SELECT 'message', message FROM ended
