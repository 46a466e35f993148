-- What does the body weigh in each variant, of aluminium of 2.81 g/cm3?
SELECT v.variant, s.volume * 2.81e-6 AS mass_kg
FROM object_variant AS v
JOIN object_part AS i ON i.object_id = v.object_id AND i.name = 'BODY'
JOIN part AS p ON p.id = i.part_id
JOIN shape AS s ON s.id = p.shape_id
WHERE v.name = 'bulkhead'
ORDER BY v.variant
