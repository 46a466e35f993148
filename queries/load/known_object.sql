-- Takes :keys, content keys separated by blanks.  Gives identity and key of the rows of object that have one of them.
SELECT object.id, object.content_key
FROM unnest(string_to_array(:keys, ' ')) AS incoming (content_key)
JOIN object ON object.content_key = incoming.content_key
