-- What a run chose of the world.
-- Takes run; gives name and value.
SELECT 'parts selected' AS name, CAST(selected_parts AS TEXT) AS value FROM inspection WHERE run_id = :run
