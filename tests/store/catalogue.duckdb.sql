SELECT 'table', schema_name, table_name, comment, temporary, has_primary_key, column_count, check_constraint_count, sql
FROM duckdb_tables() WHERE database_name = current_database();
SELECT 'column', schema_name, table_name, column_name, column_index, data_type, is_nullable, column_default, comment
FROM duckdb_columns() WHERE database_name = current_database() AND NOT internal;
SELECT 'constraint', schema_name, table_name, constraint_type, constraint_text, constraint_column_names,
    referenced_table, referenced_column_names
FROM duckdb_constraints() WHERE database_name = current_database();
SELECT 'view', schema_name, view_name, comment, sql
FROM duckdb_views() WHERE database_name = current_database() AND NOT internal;
SELECT 'index', schema_name, index_name, table_name, is_unique, sql
FROM duckdb_indexes() WHERE database_name = current_database();
SELECT 'sequence', schema_name, sequence_name, comment, start_value, min_value, max_value, increment_by, cycle
FROM duckdb_sequences() WHERE database_name = current_database();
SELECT 'function', schema_name, function_name, function_type, comment, parameters, macro_definition
FROM duckdb_functions() WHERE database_name = current_database() AND NOT internal;
SELECT 'type', schema_name, type_name, logical_type, labels
FROM duckdb_types() WHERE database_name = current_database() AND NOT internal;
SELECT 'schema', schema_name, comment FROM duckdb_schemas() WHERE database_name = current_database() AND NOT internal
