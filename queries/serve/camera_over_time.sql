-- How far the edge points that measured the pose lie from the model, by camera of a rig, in each usable inspection.
-- Takes rig (its number) and camera; gives run, began_at, serial, value (root mean square of the residuals, px), rms_sigmas (about
-- 1 where they err as expected) and points, the oldest first.
SELECT c.run_id AS run, r.began_at, i.serial, c.rms_px AS value, c.rms_sigmas, c.points
FROM camera_residual AS c
JOIN inspection AS i ON i.run_id = c.run_id AND i.verdict = 'accepted'
JOIN run AS r ON r.id = c.run_id
WHERE i.rig_id = :rig AND c.camera = :camera
ORDER BY c.run_id
