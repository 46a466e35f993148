-- Which variant did the pictures of the newest inspection that weighed them show, and how much less speaks for the others?
SELECT e.run_id, p.verdict, v.name, v.variant, e.placed, e.against, e.decided,
    max(e.log_odds) OVER (PARTITION BY e.object_no) - e.log_odds AS nats_less
FROM variant_evidence AS e
JOIN pose AS p ON p.run_id = e.run_id
JOIN object_variant AS v ON v.id = e.object_variant_id
WHERE e.run_id = (SELECT max(variant_evidence.run_id) FROM variant_evidence)
ORDER BY e.rank_no
