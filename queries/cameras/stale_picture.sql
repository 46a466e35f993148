-- An earlier inspection that had the same picture of a camera beside another picture of the other camera.
-- Takes run, camera, sha256, other_camera and other_sha256; gives run_id, of one row or none.
-- Inspections whose own pictures were stale say nothing of which picture belongs to which.
SELECT min(a.run_id) AS run_id
FROM inspection_image AS a
JOIN image AS i ON i.id = a.image_id
JOIN inspection_image AS b ON b.run_id = a.run_id AND b.camera = :other_camera
JOIN image AS j ON j.id = b.image_id
WHERE a.run_id < :run AND a.camera = :camera AND i.sha256 = :sha256 AND j.sha256 <> :other_sha256
    AND a.stale_run_id IS NULL AND b.stale_run_id IS NULL
HAVING count(*) > 0
