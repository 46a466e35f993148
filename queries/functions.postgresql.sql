-- The functions of the store that a person may call.
-- Takes nothing; gives name, comment and arguments, the names in their order.
SELECT p.proname AS name, d.description AS comment, p.proargnames[1:p.pronargs] AS arguments
FROM pg_proc AS p
JOIN pg_namespace AS n ON n.oid = p.pronamespace
JOIN pg_description AS d ON d.objoid = p.oid AND d.classoid = CAST('pg_proc' AS REGCLASS)
WHERE n.nspname = current_schema()
ORDER BY p.proname
