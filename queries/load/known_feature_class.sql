-- Rows of feature_class that have one of some keys.
-- Takes the relation sought (content_key); gives identity and key.
SELECT feature_class.id, feature_class.content_key
FROM sought
JOIN feature_class ON feature_class.content_key = sought.content_key
