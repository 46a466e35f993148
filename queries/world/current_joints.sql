-- Where the joints stand in the newest revision of a world.
-- Takes world (its name); gives object_no, robot, joint and value.
SELECT j.object_no, j.robot, j.joint, j.value
FROM joint_state AS j
JOIN placed_object AS p ON p.object_no = j.object_no
WHERE p.world = :world AND j.last_revision IS NULL
