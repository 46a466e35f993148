-- The newest inspection: one that was refused for what it was given, such as a file that is not there, is none.
-- Takes nothing; gives no row or one.
SELECT r.id AS run_id
FROM run AS r
WHERE r.kind = 'inspect' AND NOT EXISTS (SELECT 1 FROM run_event AS e WHERE e.run_id = r.id AND e.cause = 'input')
ORDER BY r.id DESC
LIMIT 1
