-- Sampled points of all arcs of shapes, to compare with a volume.
-- Takes shape_ids (array); gives one row an arc, in order of shape and arc_no.
SELECT shape_id, arc_no, points, tangents
FROM shape_arc_sample
WHERE shape_id = ANY(:shape_ids)
ORDER BY shape_id, arc_no
