-- What is not as modelled, each physical thing once, the worst first, and what a person decided of it.
-- Takes run_id; gives one row a finding, with the size that says so, and which item, placed part and feature it is of.
SELECT finding_no, path, level, state, reason, evidence, what, nominal, value, sigma, unit, least_difference, together,
    decision, decided_by, note, decided_at, item_no, occurrence_id, feature_no
FROM finding
WHERE run_id = :run_id
ORDER BY finding_no
