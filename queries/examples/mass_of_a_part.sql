-- What does BULKHEAD_BODY weigh in each variant of bulkhead?
SELECT DISTINCT variant, revision, mass AS mass_kg
FROM placed_part
WHERE object = 'bulkhead' /* object */ AND number = 'BULKHEAD_BODY' /* number */
ORDER BY variant
