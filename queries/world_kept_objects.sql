-- The objects of a world that stand as they stood in the revision before: same name, object, place and joints.
-- Takes world_id and previous (the revision before).
-- Gives was_no and now_no, the ordinals that each had and has, sorted by now_no.
WITH stand AS (
    SELECT w.name, j.robot, j.joint, j.value
    FROM joint_state AS j
    JOIN world_object AS w ON w.world_id = j.world_id AND w.object_no = j.object_no
    WHERE j.world_id IN (:world_id, :previous)
),
moved AS (
    SELECT DISTINCT name
    FROM (SELECT name FROM stand GROUP BY name, robot, joint HAVING count(*) <> 2 OR min(value) <> max(value)) AS joints
)
SELECT b.object_no AS was_no, w.object_no AS now_no
FROM world_object AS w
JOIN world_object AS b ON b.name = w.name AND b.object_variant_id = w.object_variant_id
    AND b.m00 = w.m00 AND b.m01 = w.m01 AND b.m02 = w.m02 AND b.m03 = w.m03
    AND b.m10 = w.m10 AND b.m11 = w.m11 AND b.m12 = w.m12 AND b.m13 = w.m13
    AND b.m20 = w.m20 AND b.m21 = w.m21 AND b.m22 = w.m22 AND b.m23 = w.m23
WHERE w.world_id = :world_id AND b.world_id = :previous
    AND NOT EXISTS (SELECT 1 FROM moved AS m WHERE m.name = w.name)
ORDER BY w.object_no
