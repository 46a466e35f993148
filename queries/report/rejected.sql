-- The arcs of the pictures that were left without a model arc, with the nearest candidate and why it was not taken, the
-- longest first.
-- Takes run_id; gives one row an arc; px.
SELECT camera, image_arc_no, kind, length, contrast, reason, residual, view_arc_no
FROM rejected_arc
WHERE run_id = :run_id
ORDER BY length DESC, camera, image_arc_no
