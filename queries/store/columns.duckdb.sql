-- Columns of all tables, in their order.
-- Takes nothing; gives relation, name, and type as DuckDB spells it.
SELECT table_name AS relation, column_name AS name, data_type AS type
FROM duckdb_columns()
WHERE database_name = current_database() AND schema_name = current_schema()
    AND table_oid IN (SELECT table_oid FROM duckdb_tables())
ORDER BY relation, column_index
