-- The newest revision of each world.
-- Takes nothing; gives world_id, name, revision, content_key, sorted by name.
SELECT world_id, name, revision, content_key
FROM current_world
ORDER BY name
