-- What a run chose of the world: how many parts, and which.
-- Takes run; gives name and value.
SELECT 'parts selected' AS name, CAST(count(*) AS TEXT) AS value FROM selected_part WHERE run_id = :run
UNION ALL
SELECT o.path, CASE WHEN s.shown THEN 'selected' ELSE 'selected, superfluous' END
FROM selected_part AS s
JOIN placed_node AS o ON o.id = s.occurrence_id
WHERE s.run_id = :run
