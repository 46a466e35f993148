-- Writes for each table a statement that reads every value of it.
-- Takes nothing; gives relation, statement.
SELECT relname AS relation, format('SELECT bit_xor(hashtextextended(CAST(t AS TEXT), 0)) FROM %I AS t', relname) AS statement
FROM pg_class
WHERE relnamespace = current_schema()::regnamespace AND relkind = 'r'
ORDER BY relation
