-- Which tables point at which by a foreign key.
-- Takes nothing; gives relation and parent, the table that it points at.
SELECT DISTINCT table_name AS relation, referenced_table AS parent
FROM duckdb_constraints()
WHERE database_name = current_database() AND schema_name = current_schema() AND constraint_type = 'FOREIGN KEY'
ORDER BY relation, parent
