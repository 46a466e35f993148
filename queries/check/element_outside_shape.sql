-- Surfaces and arcs that stick out of the box of a shape that lists them, by more than 1e-6 mm.
-- Takes nothing; gives shape_id, level and element_no.
SELECT e.shape_id, e.level, e.element_no
FROM shape_box AS e
JOIN shape AS s ON s.id = e.shape_id
WHERE e.level <> 'feature' AND (
    e.x0 < s.x0 - 1e-6 OR e.y0 < s.y0 - 1e-6 OR e.z0 < s.z0 - 1e-6
    OR e.x1 > s.x1 + 1e-6 OR e.y1 > s.y1 + 1e-6 OR e.z1 > s.z1 + 1e-6
)
ORDER BY e.shape_id, e.level, e.element_no
