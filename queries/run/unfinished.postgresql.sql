-- Runs that neither ended nor have a living process: nobody holds their lock.
-- Takes nothing; gives run_id and event_no, the ordinal of their next event.
SELECT run_id, event_no
FROM (
    SELECT run_id, max(event_no) + 1 AS event_no
    FROM run_event
    GROUP BY run_id
    HAVING count(*) FILTER (WHERE kind IN ('ended', 'found_dead')) = 0
    OFFSET 0  -- keeps the lock from being tried on runs that ended
) AS unfinished
WHERE pg_try_advisory_xact_lock(run_id)
ORDER BY run_id
