-- Residuals of the edge points that measured the pose, by camera.
-- Takes run_id; gives one row a camera: points, weighted rms in px, and that over the standard deviations expected.
SELECT camera, points, weight, rms_px, rms_sigmas
FROM camera_residual
WHERE run_id = :run_id
ORDER BY camera
