-- The inspections that are to be pruned, which are not yet.
-- Takes what (runs or pictures) and, null for any, run, state, verdict and before (a time); gives run_id.
SELECT r.run_id FROM run_summary AS r
WHERE r.kind = 'inspect' AND r.state <> 'running'
    AND (CAST(:run AS BIGINT) IS NULL OR r.run_id = CAST(:run AS BIGINT))
    AND (CAST(:state AS TEXT) IS NULL OR r.state = CAST(:state AS TEXT))
    AND (CAST(:verdict AS TEXT) IS NULL OR r.verdict = CAST(:verdict AS TEXT))
    AND (CAST(:before AS TIMESTAMPTZ) IS NULL OR r.began_at < CAST(:before AS TIMESTAMPTZ))
    AND NOT EXISTS (SELECT 1 FROM pruned_run AS p WHERE p.run_id = r.run_id AND p.what IN ('runs', :what))
ORDER BY r.run_id
