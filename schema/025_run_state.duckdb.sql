-- The state of each run.  SQL cannot tell whether the process of a run lives: relmodel, when it opens a file,
-- notes what was killed, or where it only reads names those runs in the variable dead_runs of its connections.

CREATE VIEW run_state (  -- run: What state each run is in.
    run_id,  -- the run
    state  -- running, finished, failed or killed: without an end, and its process gone
) AS
SELECT r.id AS run_id,
    CASE
        WHEN e.state IS NOT NULL THEN e.state
        WHEN list_contains(CAST(getvariable('dead_runs') AS BIGINT[]), r.id) THEN 'killed'
        ELSE 'running'
    END AS state
FROM run AS r
LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead');
