-- What the pictures say of each loaded variant of the inspected objects, by object, the likeliest first.
-- Takes run_id; gives one row a variant where variants were weighed: log odds of its edges, how many of the parts and
-- features that are decided differ from it, and those that distinguish it from the likeliest, worst first.
SELECT v.name AS object, v.variant, e.placed, e.log_odds, e.against, e.decided, e.distinguished_by
FROM variant_evidence AS e
JOIN object_variant AS v ON v.id = e.object_variant_id
WHERE e.run_id = :run_id
ORDER BY e.rank_no
