-- Where the joints of a robot in a world stand.
-- Takes world_id, object_no.  Gives joint, value (rad or mm), by name.
SELECT joint, value
FROM joint_state
WHERE world_id = :world_id AND object_no = :object_no
ORDER BY joint
