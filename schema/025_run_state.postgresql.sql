-- The state of each run.  A session of a run's process holds an advisory lock of the run's number as long as it lives.

CREATE VIEW run_state (  -- run: What state each run is in.
    run_id,  -- the run
    state  -- running, finished, failed or killed: without an end, and its process gone
) AS
SELECT r.id AS run_id,
    CASE
        WHEN e.state IS NOT NULL THEN e.state
        WHEN EXISTS (
            SELECT 1
            FROM pg_locks AS l
            JOIN pg_database AS d ON d.oid = l.database
            WHERE l.locktype = 'advisory' AND l.objsubid = 1 AND l.granted AND d.datname = current_database()
                AND ((CAST(CAST(l.classid AS BIGINT) AS BIT(64)) << 32) | CAST(CAST(l.objid AS BIGINT) AS BIT(64)))
                    = CAST(r.id AS BIT(64))
        ) THEN 'running'
        ELSE 'killed'
    END AS state
FROM run AS r
LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead');
