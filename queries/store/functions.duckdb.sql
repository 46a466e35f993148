-- The functions of the store that a person may call.
-- Takes nothing; gives name and comment.
SELECT function_name AS name, any_value(comment) AS comment
FROM duckdb_functions()
WHERE NOT internal AND comment IS NOT NULL AND function_name IN (SELECT a.function_name FROM sds_argument AS a)
GROUP BY function_name
ORDER BY function_name
