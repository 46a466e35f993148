-- Joins the relation sought (content_key).  Gives identity and key of the rows of surface that have one of them.
SELECT surface.id, surface.content_key
FROM sought
JOIN surface ON surface.content_key = sought.content_key
