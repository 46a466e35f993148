-- The poses that the join of circles gave an inspection, the best first.
-- Takes run; gives score and the pose as m00 .. m23.
SELECT p.score, p.m00, p.m01, p.m02, p.m03, p.m10, p.m11, p.m12, p.m13, p.m20, p.m21, p.m22, p.m23
FROM search_pose AS p
JOIN search_stage AS s ON s.run_id = p.run_id AND s.stage_no = p.stage_no AND s.name IN ('join', 'lines')
WHERE p.run_id = :run
ORDER BY p.pose_no
