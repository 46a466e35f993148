-- All placed parts of a world, or the one of a path, to hold in process.
-- Takes world_id and path (or null); gives occurrence_id, shape_id, the box of the shape in its own frame shape_x0
-- .. shape_z1 and world_from_occurrence m00 .. m23, sorted by occurrence_id.
SELECT o.id AS occurrence_id, o.shape_id,
    s.x0 AS shape_x0, s.y0 AS shape_y0, s.z0 AS shape_z0, s.x1 AS shape_x1, s.y1 AS shape_y1, s.z1 AS shape_z1,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
FROM occurrence AS o
JOIN shape AS s ON s.id = o.shape_id
WHERE o.world_id = :world_id AND o.kind = 'part' AND (CAST(:path AS TEXT) IS NULL OR o.path = :path)
ORDER BY o.id
