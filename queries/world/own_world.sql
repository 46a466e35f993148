-- The world made for an object by itself, where `--against` compares pictures with it.
-- Takes name (of the world); gives world_id.
SELECT id AS world_id
FROM world
WHERE name = :name AND revision = 0
