-- Takes :keys, content keys separated by blanks.  Gives identity and key of the rows of arc that have one of them.
SELECT arc.id, arc.content_key
FROM unnest(string_to_array(:keys, ' ')) AS incoming (content_key)
JOIN arc ON arc.content_key = incoming.content_key
