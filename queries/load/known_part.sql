-- Takes :keys, content keys separated by blanks.  Gives identity and key of the rows of part that have one of them.
SELECT part.id, part.content_key
FROM unnest(string_to_array(:keys, ' ')) AS incoming (content_key)
JOIN part ON part.content_key = incoming.content_key
