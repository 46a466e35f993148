-- Where the joints of the robots in an object of a world stand.
-- Takes world_id, object_no.  Gives robot (path in the object), joint, value (rad or mm), by robot and joint.
SELECT robot, joint, value
FROM joint_state
WHERE world_id = :world_id AND object_no = :object_no
ORDER BY robot, joint
