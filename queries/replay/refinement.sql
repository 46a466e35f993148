-- What the last step of a refinement set out from.
-- Takes run; gives no row or one: the pose as m00 .. m23, covariance (36), the middle of what is seen, and excluded.
SELECT m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23,
    covariance, middle_x, middle_y, middle_z, excluded
FROM refinement
WHERE run_id = :run
