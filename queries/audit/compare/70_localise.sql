-- The poses that a run refined, and what each gathered.
-- Takes run; gives name and value.
SELECT 'hypotheses' AS name, CAST(count(*) AS TEXT) AS value FROM hypothesis WHERE run_id = :run
UNION ALL
SELECT concat('cost of hypothesis ', hypothesis_no), CAST(cost AS TEXT) FROM hypothesis WHERE run_id = :run
UNION ALL
SELECT concat('image arcs matched in ', camera), CAST(sum(CASE WHEN matched THEN 1 ELSE 0 END) AS TEXT)
FROM why_image_arc
WHERE run_id = :run
GROUP BY camera
