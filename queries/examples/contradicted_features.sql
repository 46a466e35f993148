-- Which features of the bulkhead were contradicted or not confirmed in its last hundred accepted inspections, by world, how often, and how surely each is not there?
WITH last AS (
    SELECT i.run_id, c.name AS world
    FROM inspection AS i
    JOIN world AS c ON c.id = i.world_id
    JOIN pose AS p ON p.run_id = i.run_id AND p.verdict = 'accepted'
    WHERE EXISTS (
        SELECT 1
        FROM world_object AS w
        JOIN object_variant AS v ON v.id = w.object_variant_id
        WHERE w.world_id = i.world_id AND v.name = 'bulkhead' /* object */
    )
    ORDER BY i.run_id DESC
    LIMIT 100 /* inspections */
)
SELECT last.world, s.path, count(*) AS runs, max(s.run_id) AS newest,
    1 / (1 + exp(max(s.log_odds))) AS least_probability, 1 / (1 + exp(min(s.log_odds))) AS greatest_probability
FROM presence AS s
JOIN last ON last.run_id = s.run_id
WHERE s.level = 'feature' AND s.state IN ('contradicted', 'not_confirmed')
GROUP BY last.world, s.path
ORDER BY runs DESC, greatest_probability DESC, last.world, s.path
