-- The extractions of some images.
-- Takes the relation asked_image of image_id; gives extraction_id.
SELECT id AS extraction_id
FROM extraction
WHERE image_id IN (SELECT image_id FROM asked_image)
ORDER BY id
