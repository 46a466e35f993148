-- Joins the relation sought (content_key).  Gives identity and key of the rows of arc that have one of them.
SELECT arc.id, arc.content_key
FROM sought
JOIN arc ON arc.content_key = sought.content_key
