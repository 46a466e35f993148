-- The sizes that its edges gave.
-- Takes run and path; gives sentence.
SELECT concat('measured ', m.what, ': ', CAST(m.value AS NUMERIC(18, 2)), ' ', m.unit, ' (sigma ',
    CAST(m.sigma AS NUMERIC(18, 2)), '), by the model ', CAST(m.nominal AS NUMERIC(18, 2)), ' ', m.unit,
    CASE WHEN m.changed THEN ': surely another' ELSE '' END) AS sentence
FROM presence AS p
JOIN measured_size AS m ON m.run_id = p.run_id AND m.item_no = p.item_no
WHERE p.run_id = :run AND p.path = :path AND m.what <> 'distance'
ORDER BY m.measure_no
