-- Joins the relation sought (content_key).  Gives identity and key of the rows of object that have one of them.
SELECT object.id, object.content_key
FROM sought
JOIN object ON object.content_key = sought.content_key
