-- Features of shapes with their dimensions and surfaces.
-- Takes shape_ids (array); gives one row a feature, in order of shape and feature; the middle of its box in the frame
-- of the shape, mm.
SELECT f.shape_id, f.feature_no, k.kind, f.name, (f.x0 + f.x1) / 2 AS x, (f.y0 + f.y1) / 2 AS y, (f.z0 + f.z1) / 2 AS z,
    string_agg(d.name || ' ' || CAST(round(CAST(d.value AS NUMERIC(18, 4)), 3) AS TEXT), ', ' ORDER BY d.name)
        AS dimensions,
    (SELECT array_agg(s.surface_no ORDER BY s.surface_no) FROM feature_surface AS s
        WHERE s.shape_id = f.shape_id AND s.feature_no = f.feature_no) AS surfaces
FROM feature AS f
JOIN feature_class AS k ON k.id = f.feature_class_id
LEFT JOIN feature_dimension AS d ON d.feature_class_id = k.id
WHERE f.shape_id = ANY(:shape_ids)
GROUP BY f.shape_id, f.feature_no, k.kind, f.name, f.x0, f.x1, f.y0, f.y1, f.z0, f.z1
ORDER BY f.shape_id, f.feature_no
