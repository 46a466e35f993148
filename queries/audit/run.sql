-- A run, what it recorded of its parameters and packages, and how it ended.
-- Takes run_id; gives no row or one; parameters and versions as JSON.
-- As `run_summary` has it, whose outcome takes ten times as long to plan.
SELECT r.id AS run_id, r.kind, s.state, i.verdict, e.message, r.began_at, e.seconds, r.host,
    CAST(r.parameters AS TEXT) AS parameters, CAST(r.versions AS TEXT) AS versions
FROM run AS r
JOIN run_state AS s ON s.run_id = r.id
LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead')
LEFT JOIN inspection AS i ON i.run_id = r.id
WHERE r.id = :run_id
