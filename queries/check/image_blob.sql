-- Bytes of images that are not there, kept twice, or not those that were read.
-- Takes nothing; gives image_id and how many such rows.
SELECT b.image_id, count(*) AS copies
FROM image_blob AS b
LEFT JOIN image AS i ON i.id = b.image_id
GROUP BY b.image_id
-- The digest is text on one engine, and bytes on the other, of which the text begins with \x.
HAVING count(*) > 1
    OR count(i.id) < count(*)
    OR max(CASE WHEN replace(CAST(sha256(b.bytes) AS TEXT), '\x', '') <> i.sha256 THEN 1 ELSE 0 END) = 1
ORDER BY b.image_id
