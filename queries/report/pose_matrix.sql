-- The pose of the rig as a matrix with its covariance, in the rig's frame and in the world's axes.
-- Takes run_id; gives no row or one: none where there is neither a pose nor a prior.
SELECT p.m00, p.m01, p.m02, p.m03, p.m10, p.m11, p.m12, p.m13, p.m20, p.m21, p.m22, p.m23,
    p.covariance, w.covariance AS covariance_world
FROM pose AS p
JOIN pose_world AS w ON w.run_id = p.run_id
WHERE p.run_id = :run_id AND p.covariance IS NOT NULL
