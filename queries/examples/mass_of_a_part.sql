-- What does the body weigh in each variant?
SELECT DISTINCT variant, revision, mass AS mass_kg
FROM placed_part
WHERE object = 'bulkhead' /* object */ AND number = 'BULKHEAD_BODY' /* part */
ORDER BY variant
