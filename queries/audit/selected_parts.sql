-- The placed parts that an inspection considered.
-- Takes run; gives occurrence_id, and shown: whether a sampled pose shows it.
SELECT occurrence_id, shown FROM selected_part WHERE run_id = :run ORDER BY occurrence_id
