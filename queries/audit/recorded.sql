-- What a run recorded of its parameters and packages.
-- Takes run; gives parameters and versions, JSON.
SELECT CAST(parameters AS TEXT) AS parameters, CAST(versions AS TEXT) AS versions
FROM run
WHERE id = :run
