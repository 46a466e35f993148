-- Takes :keys, content keys separated by blanks.  Gives identity and key of the rows of surface that have one of them.
SELECT surface.id, surface.content_key
FROM unnest(string_to_array(:keys, ' ')) AS incoming (content_key)
JOIN surface ON surface.content_key = incoming.content_key
