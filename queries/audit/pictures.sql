-- The pictures of an inspection and their extractions.
-- Takes run; gives camera, file_name, bytes (null where they were not kept), bits, bits_from, extraction_id and
-- unit_set_id, in the order of the rig.
SELECT v.camera, p.file_name, b.bytes, e.bits, e.bits_from, e.id AS extraction_id, s.id AS unit_set_id
FROM inspection_image AS v
JOIN image AS p ON p.id = v.image_id
JOIN extraction AS e ON e.id = v.extraction_id
JOIN unit_set AS s ON s.extraction_id = e.id
LEFT JOIN image_blob AS b ON b.image_id = p.id
WHERE v.run_id = :run
ORDER BY v.camera_no
