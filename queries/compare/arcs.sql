-- Arcs as functions.
-- Takes arc_ids (array); gives the columns of arc that relmodel.geometry.curves evaluates, in order of id.
SELECT id, kind, origin_x, origin_y, origin_z, axis_x_x, axis_x_y, axis_x_z, axis_z_x, axis_z_y, axis_z_z,
    radius, radius2, t0, t1
FROM arc
WHERE id = ANY(:arc_ids)
ORDER BY id
