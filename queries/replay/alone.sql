-- The pose that each camera of an inspection gives by itself.
-- Takes run; gives the pose as m00 .. m23 and covariance (36).
SELECT m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23,
    covariance
FROM camera_alone
WHERE run_id = :run
ORDER BY camera
