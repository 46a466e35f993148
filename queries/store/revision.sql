-- Revision of the schema that the store has: of a database with a dictionary, as any other may have revisions.
-- Takes nothing; gives version_num.
SELECT version_num FROM alembic_version WHERE EXISTS (SELECT 1 FROM sds_relation)
