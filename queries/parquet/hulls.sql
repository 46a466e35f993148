-- Corners of the hulls of the shapes in the objects that are or were placed in some worlds, one row each; none of shapes
-- that fill their box.
-- Takes worlds (array of names); gives shape_id, x, y, z in the shape's frame and beyond_mm, by which the shape reaches
-- beyond its hull, mm, sorted by the first four.
SELECT h.shape_id, h.x, h.y, h.z, h.beyond_mm
FROM (
    SELECT s.id AS shape_id, unnest(s.hull_x) AS x, unnest(s.hull_y) AS y, unnest(s.hull_z) AS z, s.hull_mm AS beyond_mm
    FROM shape AS s
    WHERE s.id IN (
        SELECT shape_id
        FROM object_node
        WHERE object_id IN (SELECT object_id FROM placed_object WHERE world = ANY(:worlds))
    )
) AS h
ORDER BY h.shape_id, h.x, h.y, h.z
