-- Boxes in the index of a shape that do not hold the box of their feature, surface or arc, and elements that it lacks.
-- Shapes share surfaces and arcs that are equal to 1e-6 mm, and so their boxes to that.
-- Takes nothing; gives shape_id, level and element_no.
WITH element AS (
    SELECT shape_id, 'feature' AS level, feature_no AS element_no, x0, y0, z0, x1, y1, z1
    FROM feature
    UNION ALL
    SELECT u.shape_id, 'surface', u.surface_no, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1
    FROM shape_surface AS u
    JOIN surface AS s ON s.id = u.surface_id
    UNION ALL
    SELECT u.shape_id, 'arc', u.arc_no, a.x0, a.y0, a.z0, a.x1, a.y1, a.z1
    FROM shape_arc AS u
    JOIN arc AS a ON a.id = u.arc_id
)
SELECT coalesce(b.shape_id, e.shape_id) AS shape_id, coalesce(b.level, e.level) AS level, coalesce(b.element_no, e.element_no) AS element_no
FROM shape_box AS b
FULL JOIN element AS e ON e.shape_id = b.shape_id AND e.level = b.level AND e.element_no = b.element_no
WHERE b.shape_id IS NULL OR e.shape_id IS NULL
    OR b.x0 > e.x0 + 1e-6 OR b.y0 > e.y0 + 1e-6 OR b.z0 > e.z0 + 1e-6
    OR b.x1 < e.x1 - 1e-6 OR b.y1 < e.y1 - 1e-6 OR b.z1 < e.z1 - 1e-6
ORDER BY shape_id, level, element_no
