-- Surfaces and arcs that stick out of the box of a shape that lists them, by more than 1e-6 mm.
-- Takes nothing; gives shape_id, level and element_no.
WITH element AS (
    SELECT u.shape_id, 'surface' AS level, u.surface_no AS element_no, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1
    FROM shape_surface AS u
    JOIN surface AS s ON s.id = u.surface_id
    UNION ALL
    SELECT u.shape_id, 'arc', u.arc_no, a.x0, a.y0, a.z0, a.x1, a.y1, a.z1
    FROM shape_arc AS u
    JOIN arc AS a ON a.id = u.arc_id
)
SELECT e.shape_id, e.level, e.element_no
FROM element AS e
JOIN shape AS s ON s.id = e.shape_id
WHERE e.x0 < s.x0 - 1e-6 OR e.y0 < s.y0 - 1e-6 OR e.z0 < s.z0 - 1e-6
    OR e.x1 > s.x1 + 1e-6 OR e.y1 > s.y1 + 1e-6 OR e.z1 > s.z1 + 1e-6
ORDER BY e.shape_id, e.level, e.element_no
