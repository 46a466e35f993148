-- What is visible in the camera left of the newest inspection, by the length of its edges?
SELECT d.path, count(*) AS edges, sum(d.length) AS pixels, sum(d.supported_px) AS found_pixels
FROM why_view_arc AS d
WHERE d.run_id = (SELECT max(pose.run_id) FROM pose) AND d.camera = 'left' /* camera */
GROUP BY d.path
ORDER BY pixels DESC, d.path
