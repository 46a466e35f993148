-- Takes :keys, content keys separated by blanks.  Gives identity and key of the rows of shape that have one of them.
SELECT shape.id, shape.content_key
FROM unnest(string_to_array(:keys, ' ')) AS incoming (content_key)
JOIN shape ON shape.content_key = incoming.content_key
