-- The placed parts that an inspection considered.
-- Takes run; gives occurrence_id.
SELECT occurrence_id
FROM selected_part
WHERE run_id = :run
ORDER BY occurrence_id
