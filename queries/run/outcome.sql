-- The outcome of an inspection in addition to its verdict.
-- Takes run; gives no row or one.
SELECT outcome, changed, contradicted, not_confirmed, undecidable, variant
FROM inspection_outcome
WHERE run_id = :run
