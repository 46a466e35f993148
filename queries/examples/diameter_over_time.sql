-- What was the diameter of the bulkhead's hole 33 in each inspection that measured it, oldest first, and was it the model's?
SELECT r.id AS run_id, r.began_at, w.name AS world, w.revision, p.verdict, m.nominal, m.value AS diameter, m.sigma, m.changed
FROM measured_size AS m
JOIN presence AS s ON s.run_id = m.run_id AND s.item_no = m.item_no
JOIN run AS r ON r.id = m.run_id
JOIN pose AS p ON p.run_id = m.run_id
JOIN inspection AS i ON i.run_id = m.run_id
JOIN world AS w ON w.id = i.world_id
WHERE s.path = 'bulkhead/BODY/through_hole 33' /* path */ AND m.what = 'diameter'
ORDER BY r.id, m.measure_no
