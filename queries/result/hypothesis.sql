-- The poses that an inspection considered, the best first.
-- Takes run_id; gives cost, evidence, distance from the prior (sigmas) and world_from_rig as m00 .. m23.
SELECT
    hypothesis_no, cost, evidence_ratio, distance, account_log_odds,
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
FROM hypothesis
WHERE run_id = :run_id
ORDER BY hypothesis_no
