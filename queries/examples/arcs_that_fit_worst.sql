-- Which model arcs fit the edges of the newest inspection worst, in the mean by weight, in pixels and in sigmas?
SELECT camera, path, view_kind, arc_no, surface_no, count(*) AS points, sum(weight) AS weight,
    sqrt(sum(weight * residual * residual) / sum(weight)) AS rms_px,
    sqrt(sum(weight * residual * residual / (sigma * sigma)) / sum(weight)) AS rms_sigmas
FROM edge_residual
WHERE run_id = (SELECT max(pose.run_id) FROM pose) AND weight > 0 AND path IS NOT NULL
GROUP BY camera, path, view_kind, arc_no, surface_no
ORDER BY rms_sigmas DESC, camera, path, arc_no, surface_no
LIMIT 20
