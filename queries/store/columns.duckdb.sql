-- Columns of each table, in their order.
-- Takes nothing; gives relation, names, and types as DuckDB spells them.
SELECT table_name AS relation, list(column_name ORDER BY column_index) AS names,
    list(data_type ORDER BY column_index) AS types
FROM duckdb_columns()
WHERE database_name = current_database() AND schema_name = current_schema()
    AND table_oid NOT IN (SELECT view_oid FROM duckdb_views())
GROUP BY relation
