-- Inspections of which a picture was kept.
-- Takes low and high, numbers of the first and the last run to look at; gives run.
SELECT DISTINCT p.run_id AS run
FROM inspection_image AS p
JOIN image_blob AS b ON b.image_id = p.image_id
WHERE p.run_id BETWEEN :low AND :high
ORDER BY run
