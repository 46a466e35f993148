-- What does the body weigh in each variant?
SELECT v.variant, m.mass AS mass_kg
FROM object_variant AS v
JOIN object_part AS i ON i.object_id = v.object_id AND i.name = 'BODY' /* part */
JOIN part_mass AS m ON m.part_id = i.part_id
WHERE v.name = 'bulkhead' /* object */
ORDER BY v.variant
