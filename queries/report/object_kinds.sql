-- How many features of each kind shapes have.
-- Takes shape_ids (array); gives one row a kind, the most frequent first.
SELECT k.kind, count(*) AS features, count(DISTINCT f.shape_id) AS shapes
FROM feature AS f
JOIN feature_class AS k ON k.id = f.feature_class_id
WHERE f.shape_id = ANY(:shape_ids)
GROUP BY k.kind
ORDER BY features DESC, k.kind
