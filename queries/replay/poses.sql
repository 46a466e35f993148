-- The poses of the rig that an inspection was given, went through and came to.
-- Takes run; gives what (prior, contradicted, which is a prior that the pose was found without, start, pose,
-- explanation, single_camera, equivalent), the pose as m00 .. m23, covariance (36) and log_odds.
WITH poses AS (
    SELECT CASE WHEN EXISTS (SELECT 1 FROM verdict_statistic AS s WHERE s.run_id = :run AND s.name = 'prior_mm')
            THEN 'contradicted' ELSE 'prior' END AS what, 0 AS number,
        m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, prior_covariance AS covariance, 0.0 AS log_odds
    FROM inspection WHERE run_id = :run AND prior_covariance IS NOT NULL
    UNION ALL
    SELECT 'pose', 0, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, covariance, 0.0
    FROM pose WHERE run_id = :run AND covariance IS NOT NULL
    UNION ALL
    SELECT kind, solved_no, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, covariance, log_odds
    FROM solved_pose WHERE run_id = :run
)
SELECT what, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, covariance, log_odds
FROM poses
ORDER BY what, number
