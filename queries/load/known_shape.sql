-- Rows of shape that have one of some keys.
-- Takes the relation sought (content_key); gives identity and key.
SELECT shape.id, shape.content_key
FROM sought
JOIN shape ON shape.content_key = sought.content_key
