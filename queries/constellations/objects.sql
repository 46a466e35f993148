-- The inspected objects of a world.
-- Takes world_id; gives object_id and world_from_object as m00 .. m23.
SELECT object_id, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
FROM world_object
WHERE world_id = :world_id AND role = 'inspected'
ORDER BY object_no
