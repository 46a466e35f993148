-- Boxes of the elements of a level of all shapes that are placed in a world, to hold in process.
-- Takes world_id and level (feature, surface, arc); gives shape_id, element_no, x0 .. z1 in the shape's frame, sorted
-- by the first two.
SELECT e.shape_id, e.element_no, e.x0, e.y0, e.z0, e.x1, e.y1, e.z1
FROM shape_box AS e
WHERE e.level = :level AND e.shape_id IN (SELECT shape_id FROM occurrence WHERE world_id = :world_id)
ORDER BY e.shape_id, e.element_no
