-- Where the cameras of an inspection stand at its pose.
-- Takes run; gives world_from_camera as m00 .. m23, in the order of the views.
SELECT m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
FROM view
WHERE run_id = :run
ORDER BY view_no
