-- The placed parts of a physical part, to be drawn.
-- Takes serial; gives one row a part.
SELECT o.id, o.path, o.shape_id, o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
FROM serial_evidence AS s
JOIN occurrence AS o ON o.world_id = s.world_id AND o.id = s.occurrence_id
WHERE s.serial = :serial AND s.level = 'part'
ORDER BY o.id
