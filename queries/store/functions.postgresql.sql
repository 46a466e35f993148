-- The functions of the store that a person may call.
-- Takes nothing; gives name and comment.
SELECT p.proname AS name, d.description AS comment
FROM pg_proc AS p
JOIN pg_namespace AS n ON n.oid = p.pronamespace
JOIN pg_description AS d ON d.objoid = p.oid AND d.classoid = CAST('pg_proc' AS REGCLASS)
WHERE n.nspname = current_schema() AND p.proname IN (SELECT a.function_name FROM sds_argument AS a)
ORDER BY p.proname
