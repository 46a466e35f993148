-- The newest inspection.
-- Takes nothing; gives no row or one.
SELECT id AS run_id
FROM run
WHERE kind = 'inspect'
ORDER BY id DESC
LIMIT 1
