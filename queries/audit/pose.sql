-- The pose of a run and its covariance, in the rig's frame and along the world's axes.
-- Takes run; gives no row where there is neither a pose nor a prior, else the twelve numbers of world_from_rig,
-- covariance and world_covariance (6x6 row-major).
SELECT p.m00, p.m01, p.m02, p.m03, p.m10, p.m11, p.m12, p.m13, p.m20, p.m21, p.m22, p.m23, p.covariance,
    w.covariance AS world_covariance
FROM pose AS p
JOIN pose_world AS w ON w.run_id = p.run_id
WHERE p.run_id = :run AND p.covariance IS NOT NULL
