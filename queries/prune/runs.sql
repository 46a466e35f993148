-- The inspections that are to be pruned, which are not yet.
-- Takes what (runs or pictures) and, null for any, run, state, verdict and before (a time); gives run_id.
SELECT r.id AS run_id
FROM run AS r
JOIN run_state AS s ON s.run_id = r.id
LEFT JOIN inspection AS i ON i.run_id = r.id
WHERE r.kind = 'inspect' AND s.state <> 'running'
    AND (CAST(:run AS BIGINT) IS NULL OR r.id = CAST(:run AS BIGINT))
    AND (CAST(:state AS TEXT) IS NULL OR s.state = CAST(:state AS TEXT))
    AND (CAST(:verdict AS TEXT) IS NULL OR i.verdict = CAST(:verdict AS TEXT))
    AND (CAST(:before AS TIMESTAMPTZ) IS NULL OR r.began_at < CAST(:before AS TIMESTAMPTZ))
    AND NOT EXISTS (SELECT 1 FROM pruned_run AS p WHERE p.run_id = r.id AND p.what IN ('runs', :what))
ORDER BY r.id
