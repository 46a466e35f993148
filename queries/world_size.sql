-- How many objects and parts a world holds.
-- Takes world_id.  Gives kind (object, part), occurrences.
SELECT kind, count(*) AS occurrences
FROM occurrence
WHERE world_id = :world_id
GROUP BY kind
ORDER BY kind
