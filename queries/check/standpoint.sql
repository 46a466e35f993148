-- Standpoints that were left out and have a picture or were solved all the same, or have part in it without a picture.
-- Takes nothing; gives run_id and name.
SELECT s.run_id, s.name
FROM standpoint AS s
LEFT JOIN inspection_image AS v ON v.run_id = s.run_id AND starts_with(v.camera, concat(s.name, '/'))
GROUP BY s.run_id, s.name, s.ignored, s.sigmas
HAVING (s.ignored AND count(v.camera) > 0) OR (NOT s.ignored AND count(v.camera) = 0)
    OR (s.ignored AND s.sigmas IS NOT NULL)
ORDER BY s.run_id, s.name
