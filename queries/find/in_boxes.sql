-- Placed parts, or their features, surfaces or arcs, whose world box meets any of some boxes, touching counts.
-- Takes volume_no, x0, y0, z0, x1, y1, z1 (arrays of one length: the boxes, mm, world), world (its name) and level (part,
-- feature, surface or arc); gives volume_no, occurrence_id, shape_id, element_no (-1 of parts), path of the part, name,
-- the world box x0 .. z1, the box in the shape's frame shape_x0 .. shape_z1 and world_from_occurrence m00 .. m23,
-- sorted by volume_no, occurrence_id, element_no.
SELECT volume_no, occurrence_id, shape_id, element_no, path, name,
    x0, y0, z0, x1, y1, z1,
    shape_x0, shape_y0, shape_z0, shape_x1, shape_y1, shape_z1,
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
FROM all_about_boxes(
    CAST(:level AS TEXT), CAST(:volume_no AS INTEGER[]),
    CAST(:x0 AS DOUBLE PRECISION[]), CAST(:y0 AS DOUBLE PRECISION[]), CAST(:z0 AS DOUBLE PRECISION[]),
    CAST(:x1 AS DOUBLE PRECISION[]), CAST(:y1 AS DOUBLE PRECISION[]), CAST(:z1 AS DOUBLE PRECISION[]), CAST(:world AS TEXT)
)
ORDER BY volume_no, occurrence_id, element_no
