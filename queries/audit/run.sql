-- A run, what it recorded of its parameters and packages, and how it ended.
-- Takes run_id; gives no row or one; parameters and versions as JSON.
SELECT s.run_id, s.kind, s.state, s.verdict, s.message, s.began_at, s.seconds, r.host,
    CAST(r.parameters AS TEXT) AS parameters, CAST(r.versions AS TEXT) AS versions
FROM run_summary AS s
JOIN run AS r ON r.id = s.run_id
WHERE s.run_id = :run_id
