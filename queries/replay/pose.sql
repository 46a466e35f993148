-- The pose and verdict of an inspection.
-- Takes run; gives no row or one: verdict, reason, posterior, the pose as m00 .. m23, covariance (36), cost, margin and
-- evidence_ratio.
SELECT verdict, reason, posterior, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23,
    covariance, cost, margin, evidence_ratio
FROM pose
WHERE run_id = :run
