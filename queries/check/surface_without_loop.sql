-- Surfaces without bounds: exact ones without a loop, but for spheres and tori.
-- Takes nothing; gives surface_id and kind.
SELECT s.id AS surface_id, s.kind
FROM surface AS s
WHERE s.provenance = 'exact'
    AND EXISTS (SELECT 1 FROM shape_surface AS u WHERE u.surface_id = s.id)
    AND s.kind NOT IN ('sphere', 'torus')
    AND NOT EXISTS (SELECT 1 FROM coedge AS c WHERE c.surface_id = s.id)
ORDER BY s.id
