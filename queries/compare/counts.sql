-- How many differences a comparison found.
-- Takes comparison_id; gives level, status and how many, sorted.
SELECT level, status, count(*) AS how_many
FROM variant_difference
WHERE comparison_id = :comparison_id
GROUP BY level, status
ORDER BY level, status
