-- How many of the parts and features in view could be checked, and how many of these are as the model has them.
-- Takes run_id; gives one row a level: all, checked (confirmed, changed or contradicted), confirmed.
SELECT level, count(*) AS in_view, sum(CASE WHEN state IN ('confirmed', 'changed', 'contradicted') THEN 1 ELSE 0 END) AS checked,
    sum(CASE WHEN state = 'confirmed' THEN 1 ELSE 0 END) AS confirmed
FROM presence
WHERE run_id = :run_id AND level <> 'surface'
GROUP BY level
ORDER BY level DESC
