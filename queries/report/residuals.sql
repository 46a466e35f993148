-- Residuals of the edge points that measured the pose, by camera.
-- Takes run_id.  Gives one row a camera: points, weighted rms in px, and that over the standard deviations expected.
SELECT v.camera, count(*) AS points, sum(m.weight) AS weight,
    sqrt(sum(m.weight * m.residual * m.residual) / sum(m.weight)) AS rms_px,
    sqrt(sum(m.weight * m.residual * m.residual / (m.sigma * m.sigma)) / sum(m.weight)) AS rms_sigmas
FROM edge_measurement AS m
JOIN view AS v ON v.run_id = m.run_id AND v.view_no = m.view_no
WHERE m.run_id = :run_id
GROUP BY v.camera
HAVING sum(m.weight) > 0
ORDER BY v.camera
