-- Bytes of images that are not there, or kept twice.
-- Takes nothing; gives image_id and how many such rows.
SELECT b.image_id, count(*) AS copies
FROM image_blob AS b
LEFT JOIN image AS i ON i.id = b.image_id
GROUP BY b.image_id
HAVING count(*) > 1 OR count(i.id) < count(*)
ORDER BY b.image_id
