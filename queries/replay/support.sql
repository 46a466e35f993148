-- What a pose gathers of the edges, by camera.
-- Takes run and hypothesis_no; gives camera, evidence, found and expected.
SELECT camera, evidence, found, expected
FROM hypothesis_support
WHERE run_id = :run AND hypothesis_no = :hypothesis_no
ORDER BY camera
