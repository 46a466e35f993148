-- Runs, the latest first.
-- Takes kind and status, null for any; gives run, kind, status (ok, refused, ambiguous, failed, running or dead),
-- began_at, seconds, message.
SELECT *
FROM (
    SELECT
        r.id AS run,
        r.kind,
        CASE WHEN e.run_id IS NULL THEN 'running' WHEN e.kind = 'found_dead' THEN 'dead' ELSE e.status END AS status,
        r.began_at,
        round(CAST(e.seconds AS NUMERIC(18, 6)), 3) AS seconds,
        e.message
    FROM run AS r
    LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead')
) AS listed
WHERE (CAST(:kind AS TEXT) IS NULL OR kind = CAST(:kind AS TEXT))
    AND (CAST(:status AS TEXT) IS NULL OR status = CAST(:status AS TEXT))
ORDER BY run DESC
