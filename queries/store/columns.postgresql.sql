-- Columns of all tables, in their order.
-- Takes nothing; gives relation, name, and type as PostgreSQL spells it.
SELECT r.relname AS relation, c.attname AS name, format_type(c.atttypid, c.atttypmod) AS type
FROM pg_attribute AS c
JOIN pg_class AS r ON r.oid = c.attrelid
WHERE r.relnamespace = current_schema()::regnamespace AND r.relkind = 'r' AND c.attnum > 0 AND NOT c.attisdropped
ORDER BY relation, c.attnum
