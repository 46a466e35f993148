-- Pairs of arcs of a picture and of a view that were considered at the best hypothesis of a run.
-- Takes run_id, view_no; gives image_arc, view_arc, reason, residual, gate, angle, overlap, first_point, last_point.
SELECT image_arc_no AS image_arc, view_arc_no AS view_arc, reason, residual, gate, angle, overlap, first_point, last_point
FROM correspondence
WHERE run_id = :run_id AND view_no = :view_no AND hypothesis_no = 0
ORDER BY image_arc_no, view_arc_no
