-- Revision of the schema that the store has.
-- Takes nothing; gives version_num.
SELECT version_num FROM alembic_version
