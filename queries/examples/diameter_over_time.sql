-- What was the diameter of the bulkhead's hole 33 in each inspection that measured it, oldest first, and was it the model's?
SELECT i.run_id, i.began_at, i.world, i.world_revision, i.verdict, m.nominal, m.value AS diameter, m.sigma, m.changed
FROM found_size AS m
JOIN inspected_object AS i ON i.run_id = m.run_id AND i.path = split_part(m.path, '/', 1)
WHERE m.path = 'bulkhead/BODY/through_hole 33' /* path */ AND m.what = 'diameter'
ORDER BY i.run_id
