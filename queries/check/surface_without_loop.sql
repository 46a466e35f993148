-- Surfaces that nothing bounds: exact ones without a loop, spheres and tori apart.
-- Takes nothing; gives surface_id and kind.
SELECT s.id AS surface_id, s.kind
FROM surface AS s
WHERE s.provenance = 'exact'
    AND s.kind NOT IN ('sphere', 'torus')
    AND NOT EXISTS (SELECT 1 FROM coedge AS c WHERE c.surface_id = s.id)
ORDER BY s.id
