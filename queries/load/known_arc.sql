-- Rows of arc that have one of some keys.
-- Takes the relation sought (content_key); gives identity and key.
SELECT arc.id, arc.content_key
FROM sought
JOIN arc ON arc.content_key = sought.content_key
