-- Takes :keys, content keys separated by blanks.  Gives identity and key of the rows of feature_class that have one of them.
SELECT feature_class.id, feature_class.content_key
FROM unnest(string_to_array(:keys, ' ')) AS incoming (content_key)
JOIN feature_class ON feature_class.content_key = incoming.content_key
