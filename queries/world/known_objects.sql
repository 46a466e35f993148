-- What was ever placed in a world.
-- Takes world (its name); gives object_no, name and object_id.
SELECT object_no, name, object_id
FROM placed_object
WHERE world = :world
