-- Joins the relation sought (content_key).  Gives identity and key of the rows of part that have one of them.
SELECT part.id, part.content_key
FROM sought
JOIN part ON part.content_key = sought.content_key
