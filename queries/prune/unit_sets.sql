-- The sets of units of some runs and extractions.
-- Takes the relations asked_run of run_id and asked_extraction of extraction_id; gives unit_set_id.
SELECT id AS unit_set_id
FROM unit_set
WHERE run_id IN (SELECT run_id FROM asked_run) OR extraction_id IN (SELECT extraction_id FROM asked_extraction)
ORDER BY id
