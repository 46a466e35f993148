-- Boxes of the shapes in the objects that are or were placed in some worlds, and of their features, surfaces and arcs.
-- Takes worlds (array of names);
-- gives shape_id, level, element_no (-1 of parts), name (none of parts: two of one shape may differ in it) and the box
-- x0 .. z1 in the shape's frame, sorted by the first three.
WITH placed AS (
    SELECT DISTINCT shape_id
    FROM object_node
    WHERE object_id IN (SELECT object_id FROM placed_object WHERE world = ANY(:worlds)) AND shape_id IS NOT NULL
)
SELECT p.shape_id, 'part' AS level, -1 AS element_no, NULL AS name, s.x0, s.y0, s.z0, s.x1, s.y1, s.z1
FROM placed AS p
JOIN shape AS s ON s.id = p.shape_id
UNION ALL
SELECT e.shape_id, e.level, e.element_no, e.name, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM placed AS p
JOIN shape_box AS e ON e.shape_id = p.shape_id
ORDER BY shape_id, level, element_no
