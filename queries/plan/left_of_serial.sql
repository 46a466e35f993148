-- What no inspection of a physical part has decided yet.
-- Takes serial; gives world_id, occurrence_id, feature_no (null of parts) and path, one row a part or feature.
SELECT world_id, occurrence_id, feature_no, path
FROM serial_evidence
WHERE serial = :serial AND state NOT IN ('confirmed', 'changed', 'contradicted')
ORDER BY occurrence_id, level DESC, feature_no
