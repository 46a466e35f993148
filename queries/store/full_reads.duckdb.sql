-- Writes for each table a statement that reads every value of it.
-- Takes nothing; gives relation, statement.
SELECT table_name AS relation, concat('SELECT bit_xor(hash(t)) FROM "', table_name, '" AS t') AS statement
FROM duckdb_tables()
WHERE database_name = current_database() AND schema_name = current_schema()
ORDER BY relation
