-- Roles beyond the database that the session may take on: those that write or read the server's files, start its
-- programs, or keep replication slots.
-- Takes nothing; gives role and session_role, the session's own: a statement can take on any role that this may, by
-- SELECT set_config('role', ...).
SELECT r.rolname AS role, session_user AS session_role
FROM pg_catalog.pg_roles AS r
WHERE pg_catalog.pg_has_role(session_user, r.oid, 'MEMBER')
    AND (r.rolsuper OR r.rolreplication
        OR r.rolname IN ('pg_execute_server_program', 'pg_read_server_files', 'pg_write_server_files'))
ORDER BY r.rolname <> session_user, NOT r.rolsuper, r.rolname
