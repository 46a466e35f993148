-- What a verdict weighed.
-- Takes run; gives name and value.
SELECT name, value
FROM verdict_sign
WHERE run_id = :run
ORDER BY name
