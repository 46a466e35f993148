-- Features of shapes by kind.
-- Takes shape_ids (array); gives shape_id, kind and how many, sorted.
SELECT f.shape_id, k.kind, count(*) AS how_many
FROM feature AS f
JOIN feature_class AS k ON k.id = f.feature_class_id
WHERE f.shape_id = ANY(:shape_ids)
GROUP BY f.shape_id, k.kind
ORDER BY f.shape_id, k.kind
