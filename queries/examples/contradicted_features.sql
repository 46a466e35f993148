-- Which features of bulkhead were contradicted or not confirmed in its last 100 accepted inspections, by world, how often, and how surely each is not there?
WITH last AS (
    SELECT DISTINCT run_id, world
    FROM inspected_object
    WHERE object = 'bulkhead' /* object */ AND verdict = 'accepted'
    ORDER BY run_id DESC
    LIMIT 100 /* inspections */
)
SELECT last.world, s.path, count(*) AS runs, max(s.run_id) AS newest,
    1 / (1 + exp(max(s.log_odds))) AS least_probability, 1 / (1 + exp(min(s.log_odds))) AS greatest_probability
FROM found_state AS s
JOIN last ON last.run_id = s.run_id
WHERE s.level = 'feature' AND s.state IN ('contradicted', 'not_confirmed')
GROUP BY last.world, s.path
ORDER BY runs DESC, greatest_probability DESC, last.world, s.path
