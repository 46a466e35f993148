-- The code that a run ran.
-- Takes run; gives name and value.
SELECT 'commit' AS name, code_commit AS value FROM run WHERE id = :run
UNION ALL SELECT 'files', code_sha256 FROM run WHERE id = :run
UNION ALL SELECT 'schema', schema_revision FROM run WHERE id = :run
