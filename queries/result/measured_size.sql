-- Sizes of what is in view, measured in the pictures.
-- Takes run_id; gives path, what was measured, the model's value, the measured one with its standard deviation, unit.
SELECT p.path, m.what, m.nominal, m.value, m.sigma, m.unit, m.changed
FROM measured_size AS m
JOIN presence AS p ON p.run_id = m.run_id AND p.item_no = m.item_no
WHERE m.run_id = :run_id AND m.what <> 'distance'
ORDER BY m.measure_no
