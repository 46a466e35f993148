-- Joins the relation sought (content_key).  Gives identity and key of the rows of shape that have one of them.
SELECT shape.id, shape.content_key
FROM sought
JOIN shape ON shape.content_key = sought.content_key
