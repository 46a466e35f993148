-- The pose and verdict of an inspection.
-- Takes run; gives no row or one: verdict, reason, posterior, the pose as m00 .. m23, covariance (36) and the middle of what
-- is seen.
SELECT p.verdict, p.reason, p.posterior, p.m00, p.m01, p.m02, p.m03, p.m10, p.m11, p.m12, p.m13, p.m20, p.m21, p.m22, p.m23,
    p.covariance, i.middle_x, i.middle_y, i.middle_z
FROM pose AS p
JOIN inspection AS i ON i.run_id = p.run_id
WHERE p.run_id = :run
