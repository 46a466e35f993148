-- Whether a transaction of a run was committed although the answer was lost.
-- Takes run, and write_no and event_no, the ordinals that the run's next writing and event had before; gives a row
-- where it was.
SELECT 1 AS committed
WHERE EXISTS (SELECT 1 FROM ledger WHERE run_id = :run AND write_no = :write_no)
    OR EXISTS (SELECT 1 FROM run_event WHERE run_id = :run AND event_no = :event_no AND kind <> 'found_dead')
