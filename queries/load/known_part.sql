-- Rows of part that have one of some keys.
-- Takes the relation sought (content_key); gives identity and key.
SELECT part.id, part.content_key
FROM sought
JOIN part ON part.content_key = sought.content_key
