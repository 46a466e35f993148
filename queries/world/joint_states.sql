-- Where the joints of the robots in an object of a world stand.
-- Takes world_id, object_no; gives robot (path in the object), joint, value (rad or mm), by robot and joint.
SELECT j.robot, j.joint, j.value
FROM world AS w
JOIN joint_state AS j ON w.revision BETWEEN j.first_revision AND coalesce(j.last_revision, w.revision)
WHERE w.id = :world_id AND j.object_no = :object_no
ORDER BY j.robot, j.joint
