-- What all inspections of a physical part say of each part and feature that its model has, what is not as modelled first.
-- Takes serial; gives one row a part or feature, with the surfaces of a feature.
SELECT s.path, s.level, s.state, s.reason, s.zone, s.stops, s.otherwise, s.run_id, s.occurrence_id, s.feature_no,
    (SELECT array_agg(f.surface_no ORDER BY f.surface_no) FROM feature_surface AS f
        WHERE f.shape_id = n.shape_id AND f.feature_no = s.feature_no) AS surfaces
FROM serial_evidence AS s
JOIN placed_node AS n ON n.id = s.occurrence_id
WHERE s.serial = :serial
ORDER BY CASE s.state WHEN 'contradicted' THEN 0 WHEN 'changed' THEN 1 WHEN 'not_confirmed' THEN 2 WHEN 'undecidable' THEN 3
    WHEN 'not_seen' THEN 4 ELSE 5 END, s.occurrence_id, s.level DESC, s.feature_no
