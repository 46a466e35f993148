-- What a decision was held against.
-- Takes run and decision; gives name and value.
SELECT name, value
FROM threshold
WHERE run_id = :run AND decision = :decision
ORDER BY name
