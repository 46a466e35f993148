-- Which kind of feature each surface of shapes belongs to; of several the first.
-- Takes shape_ids (array); gives shape_id, surface_no, kind, sorted.
SELECT m.shape_id, m.surface_no, min(k.kind) AS kind
FROM feature_surface AS m
JOIN feature AS f ON f.shape_id = m.shape_id AND f.feature_no = m.feature_no
JOIN feature_class AS k ON k.id = f.feature_class_id
WHERE m.shape_id = ANY(:shape_ids)
GROUP BY m.shape_id, m.surface_no
ORDER BY m.shape_id, m.surface_no
