-- Runs that neither ended nor have a living process: nobody holds their lock, and this transaction does from here on.
-- Takes nothing; gives run_id; some may have ended since the transaction began to look (run/unfinished).
SELECT run_id
FROM (
    SELECT run_id
    FROM run_event
    GROUP BY run_id
    HAVING count(*) FILTER (WHERE kind IN ('ended', 'found_dead')) = 0
    OFFSET 0  -- keeps the lock from being tried on runs that ended
) AS unfinished
WHERE pg_try_advisory_xact_lock(run_id)
ORDER BY run_id
