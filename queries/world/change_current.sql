-- A world has another newest revision than before.
-- Takes name, world_id, revision and content_key; gives nothing.
UPDATE current_world
SET world_id = :world_id, revision = :revision, content_key = :content_key
WHERE name = :name
