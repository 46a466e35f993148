-- What an inspection says of the characteristics of the inspected objects, of sizes with limits also in the words of QIF.
-- Takes run_id; gives one row a characteristic: number in its object, path, nominal value, limits, measured value and U, mm.
SELECT number, path, what, nominal, lower_limit, upper_limit, source, state, measured, deviation, expanded_uncertainty, decision, reason,
    CASE WHEN coalesce(lower_limit, upper_limit) IS NULL OR what IN ('presence', 'count') THEN NULL WHEN decision = 'conforms' THEN 'PASS'
        WHEN decision = 'does not conform' THEN 'FAIL' WHEN decision = 'not decidable' THEN 'INDETERMINATE' ELSE 'NOT_ANALYZED' END AS qif
FROM characteristic_result
WHERE run_id = :run_id
ORDER BY object_no, number
