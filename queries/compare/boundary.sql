-- Coedges of the surfaces of a shape.
-- Takes shape_id; gives surface_no and arc_id, in order of surface, loop and coedge.
SELECT h.surface_no, c.arc_id
FROM shape_surface AS h
JOIN coedge AS c ON c.surface_id = h.surface_id
WHERE h.shape_id = :shape_id
ORDER BY h.surface_no, c.loop_no, c.coedge_no
