-- What identifies the commits of runs: their events, and the transactions that the ledger counts.
-- Takes nothing; gives relation, run_id and ordinal, as the journal has them.
SELECT 'run_event' AS relation, run_id, event_no AS ordinal FROM run_event
UNION ALL
SELECT DISTINCT 'ledger' AS relation, run_id, write_no AS ordinal FROM ledger
