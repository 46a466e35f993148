-- Joins the relation sought (content_key).  Gives identity and key of the rows of feature_class that have one of them.
SELECT feature_class.id, feature_class.content_key
FROM sought
JOIN feature_class ON feature_class.content_key = sought.content_key
