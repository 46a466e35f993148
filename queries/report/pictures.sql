-- The pictures of a run: of an inspection by camera, of another run by the role that the file had.
-- Takes run_id; gives one row a picture; bytes null where they were not kept, the extraction used, or the newest of the
-- picture where the run did not come to use one, null where there is none.
SELECT coalesce(p.camera, r.role) AS camera, i.id AS image_id, i.file_name, i.width, i.height, b.bytes,
    coalesce(p.extraction_id, (SELECT max(e.id) FROM extraction AS e WHERE e.image_id = i.id)) AS extraction_id
FROM run_input AS r
JOIN image AS i ON i.sha256 = r.sha256
LEFT JOIN inspection_image AS p ON p.run_id = r.run_id AND p.camera = r.role
LEFT JOIN image_blob AS b ON b.image_id = i.id
WHERE r.run_id = :run_id
ORDER BY r.input_no
