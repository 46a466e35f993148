-- What does the body weigh in each variant?
SELECT v.variant, v.revision, p.mass AS mass_kg
FROM object_variant AS v
JOIN placed_part AS p ON p.object_id = v.object_id AND p.number = 'BULKHEAD_BODY' /* part */
WHERE v.name = 'bulkhead' /* object */
ORDER BY v.variant, v.revision
