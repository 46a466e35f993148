-- Rows of surface that have one of some keys.
-- Takes the relation sought (content_key); gives identity and key.
SELECT surface.id, surface.content_key
FROM sought
JOIN surface ON surface.content_key = sought.content_key
