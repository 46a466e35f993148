-- Image arcs that were left without a model arc, and why, the longest first.
-- Takes run_id; gives camera, image arc, kind, length (px), contrast (grey levels), reason, residual (px; null: none
-- near) from the nearest model arc, and that in the view.
SELECT camera, image_arc_no, kind, length, contrast, reason, residual, view_arc_no
FROM rejected_arc
WHERE run_id = :run_id
ORDER BY length DESC, camera, image_arc_no
