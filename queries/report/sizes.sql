-- Measured sizes, with the model's.
-- Takes run_id; gives one row a size, those first that differ: mm.
SELECT p.path, m.what, m.nominal, m.value, m.sigma, m.unit, m.changed
FROM measured_size AS m
JOIN presence AS p ON p.run_id = m.run_id AND p.item_no = m.item_no
WHERE m.run_id = :run_id AND m.what <> 'distance'
ORDER BY m.changed DESC, p.path, m.what
