-- How many parts, features and surfaces became what, between two variants.
-- Takes comparison_id; gives one row a level and status.
SELECT level, status, count(*) AS how_many
FROM variant_difference
WHERE comparison_id = :comparison_id
GROUP BY level, status
ORDER BY CASE level WHEN 'part' THEN 0 WHEN 'feature' THEN 1 ELSE 2 END, status
