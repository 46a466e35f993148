-- Worlds whose newest revision is not the one that current_world names.
-- Takes nothing; gives name.
SELECT coalesce(w.name, c.name) AS name
FROM (SELECT name, max(revision) AS revision FROM world WHERE revision > 0 GROUP BY name) AS newest
JOIN world AS w ON w.name = newest.name AND w.revision = newest.revision
FULL JOIN current_world AS c ON c.name = w.name
WHERE w.id IS NULL OR c.world_id IS NULL OR w.id <> c.world_id OR w.revision <> c.revision OR w.content_key <> c.content_key
ORDER BY 1
