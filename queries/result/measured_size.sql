-- Sizes of what is in view, measured in the pictures, those first that differ.
-- Takes run_id; gives path (a name that stays from run to run), what was measured, the model's value, the measured one with
-- its standard deviation, unit, how far it must differ to count as changed (null: odds decide), whether it does, and
-- the state of the part or feature, in our words and QIF's.
SELECT p.path, m.what, m.nominal, m.value, m.sigma, m.unit, l.least_difference, m.changed, p.state, p.qif, m.measure_no
FROM measured_size AS m
JOIN difference_limit AS l ON l.run_id = m.run_id AND l.measure_no = m.measure_no
JOIN presence AS p ON p.run_id = m.run_id AND p.item_no = m.item_no
WHERE m.run_id = :run_id AND m.what <> 'distance'
ORDER BY m.changed DESC, p.path, m.measure_no
