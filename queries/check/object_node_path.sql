-- Paths that stand twice in an expanded object.
-- Takes nothing; gives object_id, path and how many.
SELECT object_id, path, count(*) AS how_many
FROM object_node
GROUP BY object_id, path
HAVING count(*) > 1
ORDER BY object_id, path
