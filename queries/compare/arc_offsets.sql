-- What offset arcs are made from.
-- Takes arc_ids (array); gives rows of arc_offset, in order of arc_id.
SELECT arc_id, basis_arc_id, axis_x, axis_y, axis_z, distance
FROM arc_offset
WHERE arc_id = ANY(:arc_ids)
ORDER BY arc_id
