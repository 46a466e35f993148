-- The states of what a run has in view: parts, features and surfaces.
-- Takes run; gives name (the path) and value (the state).
SELECT path AS name, state AS value
FROM presence
WHERE run_id = :run
