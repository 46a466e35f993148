-- Which runs failed or were killed, and why?
SELECT s.run_id, s.kind, s.state, s.message
FROM run_summary AS s
WHERE s.state IN ('failed', 'killed')
ORDER BY s.run_id
