-- Corners of the convex hulls of shapes, of those that do not fill their box.
-- Takes shape_ids (array); gives shape_id, hull_x, hull_y, hull_z and hull_mm, in order of shape_id.
SELECT id AS shape_id, hull_x, hull_y, hull_z, hull_mm
FROM shape
WHERE id = ANY(CAST(:shape_ids AS BIGINT[])) AND hull_x IS NOT NULL
ORDER BY id
