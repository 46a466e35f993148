-- Triangles of shapes, for casting rays and for exact queries.
-- Takes shape_ids (array); gives one row a shape, in order of its identity.
SELECT shape_id, vertices, normals, triangles, triangle_surfaces, deviation_mm
FROM shape_mesh
WHERE shape_id = ANY(:shape_ids)
ORDER BY shape_id
