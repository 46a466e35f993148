-- A run, what it recorded of its parameters and packages, and how it ended.
-- Takes run; gives no row or one: kind, state, verdict, message, seconds, began_at, and parameters and versions as JSON.
SELECT s.kind, s.state, s.verdict, s.message, s.seconds, s.began_at,
    CAST(r.parameters AS TEXT) AS parameters, CAST(r.versions AS TEXT) AS versions
FROM run_summary AS s
JOIN run AS r ON r.id = s.run_id
WHERE s.run_id = :run
