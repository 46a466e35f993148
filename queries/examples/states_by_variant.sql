-- How many parts and features of bulkhead were found in which state, in each inspection and of which variant?
SELECT run_id, began_at, world, variant, revision, verdict, confirmed, changed, contradicted, not_confirmed, undecidable
FROM inspected_object
WHERE object = 'bulkhead' /* object */
ORDER BY run_id
