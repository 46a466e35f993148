-- The functions of the store that a person may call.
-- Takes nothing; gives name, comment and arguments, the names in their order.
SELECT function_name AS name, any_value(comment) AS comment, any_value(parameters) AS arguments
FROM duckdb_functions()
WHERE NOT internal AND comment IS NOT NULL
GROUP BY function_name
ORDER BY function_name
