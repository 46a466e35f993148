-- Poses near the best hypothesis of an inspection that it rests on.
-- Takes run and kind (start, alone, explanation); gives the pose as m00 .. m23, covariance (36) and log_odds.
SELECT m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23,
    covariance, log_odds
FROM solved_pose
WHERE run_id = :run AND kind = :kind
ORDER BY solved_no
