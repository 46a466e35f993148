-- Which code and parameters made it.
-- Takes run; gives sentence.
SELECT concat('made by ', coalesce(concat('commit ', code_commit, ', '), ''), 'code ', substr(code_sha256, 1, 12),
    ', schema ', schema_revision, '; its parameters are in run.parameters') AS sentence
FROM run
WHERE id = :run
