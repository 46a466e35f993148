-- Paths that stand twice in a world.
-- Takes nothing; gives world_id, path and how many.
SELECT world_id, path, count(*) AS how_many
FROM occurrence
GROUP BY world_id, path
HAVING count(*) > 1
ORDER BY world_id, path
