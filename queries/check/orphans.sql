-- Rows of the model that nothing uses: surfaces and arcs of no shape and no sweep, shapes of no part, parts of no
-- object, objects of no variant and no other object.
-- Takes nothing; gives relation and id.
SELECT 'surface' AS relation, id FROM surface
WHERE NOT EXISTS (SELECT 1 FROM shape_surface WHERE shape_surface.surface_id = surface.id)
    AND NOT EXISTS (SELECT 1 FROM surface_swept WHERE surface_swept.basis_surface_id = surface.id)
UNION ALL
SELECT 'arc', id FROM arc
WHERE NOT EXISTS (SELECT 1 FROM shape_arc WHERE shape_arc.arc_id = arc.id)
    AND NOT EXISTS (SELECT 1 FROM surface_swept WHERE surface_swept.basis_arc_id = arc.id)
    AND NOT EXISTS (SELECT 1 FROM arc_offset WHERE arc_offset.basis_arc_id = arc.id)
UNION ALL
SELECT 'shape', id FROM shape
WHERE NOT EXISTS (SELECT 1 FROM part WHERE part.shape_id = shape.id)
UNION ALL
SELECT 'part', id FROM part
WHERE NOT EXISTS (SELECT 1 FROM object_part WHERE object_part.part_id = part.id)
UNION ALL
SELECT 'object', id FROM object
WHERE NOT EXISTS (SELECT 1 FROM object_variant WHERE object_variant.object_id = object.id)
    AND NOT EXISTS (SELECT 1 FROM object_object WHERE object_object.child_id = object.id)
ORDER BY relation, id
