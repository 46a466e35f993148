-- Where the rig was thought to be: one row, none where the inspection had no prior.
-- Takes run_id; gives world_from_rig as m00 .. m23 and its covariance (36 numbers, as of the pose).
SELECT
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, prior_covariance AS covariance
FROM inspection
WHERE run_id = :run_id AND prior_covariance IS NOT NULL
