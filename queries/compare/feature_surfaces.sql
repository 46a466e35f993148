-- Surfaces of the features of a shape.
-- Takes shape_id; gives feature_no and surface_no, sorted.
SELECT feature_no, surface_no
FROM feature_surface
WHERE shape_id = :shape_id
ORDER BY feature_no, surface_no
