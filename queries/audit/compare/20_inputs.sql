-- What a run read, by content.
-- Takes run; gives name (the role) and value (file name and SHA-256).
SELECT role AS name, concat(name, ' ', sha256) AS value
FROM run_input
WHERE run_id = :run
