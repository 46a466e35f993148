-- Which tables point at which by a foreign key.
-- Takes nothing; gives relation and parent, the table that it points at.
SELECT DISTINCT r.relname AS relation, p.relname AS parent
FROM pg_constraint AS k
JOIN pg_class AS r ON r.oid = k.conrelid
JOIN pg_class AS p ON p.oid = k.confrelid
WHERE k.contype = 'f' AND r.relnamespace = current_schema()::regnamespace
ORDER BY relation, parent
