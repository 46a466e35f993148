-- The world in which an object stands alone.
-- Takes name (of the world); gives world_id.
SELECT id AS world_id
FROM world
WHERE name = :name AND revision = 0
