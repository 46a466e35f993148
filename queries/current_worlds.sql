-- The newest revision of each world.
-- Takes nothing.  Gives id, name, revision, content_key, sorted by name.
SELECT id, name, revision, content_key
FROM current_world
ORDER BY name
