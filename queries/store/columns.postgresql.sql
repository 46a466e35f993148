-- Columns of each table, in their order.
-- Takes nothing; gives relation, names, and types as PostgreSQL spells them.
SELECT r.relname AS relation, array_agg(c.attname::TEXT ORDER BY c.attnum) AS names,
    array_agg(format_type(c.atttypid, c.atttypmod) ORDER BY c.attnum) AS types
FROM pg_attribute AS c
JOIN pg_class AS r ON r.oid = c.attrelid
WHERE r.relnamespace = current_schema()::regnamespace AND r.relkind = 'r' AND c.attnum > 0 AND NOT c.attisdropped
GROUP BY relation
