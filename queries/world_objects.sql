-- The ordinals of the objects placed in a world.
-- Takes world_id.
-- Gives object_no, in order.
SELECT object_no
FROM world_object
WHERE world_id = :world_id
ORDER BY object_no
