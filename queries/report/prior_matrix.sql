-- The prior of an inspection as a matrix with its covariance in the rig's frame, and the world it is of.
-- Takes run_id; gives no row or one.
SELECT world_id, rig_id, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, prior_covariance AS covariance
FROM inspection
WHERE run_id = :run_id
