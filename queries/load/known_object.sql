-- Rows of object that have one of some keys.
-- Takes the relation sought (content_key); gives identity and key.
SELECT object.id, object.content_key
FROM sought
JOIN object ON object.content_key = sought.content_key
