-- Other explanations of the pictures that the covariance of a pose holds.
-- Takes run; gives the pose as m00 .. m23, covariance (36) and log_odds.
SELECT m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23,
    covariance, log_odds
FROM explanation
WHERE run_id = :run
ORDER BY explanation_no
