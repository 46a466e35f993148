-- A comparison that was made already.
-- Takes variant_a_id, variant_b_id, reach; gives id and run_id, or nothing.
SELECT id, run_id
FROM variant_comparison
WHERE variant_a_id = :variant_a_id AND variant_b_id = :variant_b_id AND reach = :reach
