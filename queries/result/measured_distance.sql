-- Distances between the axes of neighbouring holes and bosses, measured in the pictures, those first that differ.
-- Takes run_id; gives the paths of both, the model's distance, the measured one with its standard deviation, mm, and
-- whether it is surely another.
SELECT a.path, b.path AS other_path, m.nominal, m.value, m.sigma, m.changed
FROM measured_size AS m
JOIN presence AS a ON a.run_id = m.run_id AND a.item_no = m.item_no
JOIN presence AS b ON b.run_id = m.run_id AND b.item_no = m.other_item_no
WHERE m.run_id = :run_id
ORDER BY m.changed DESC, m.measure_no
