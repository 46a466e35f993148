-- Image arcs that were left without a model arc, and why.
-- Takes run_id; gives camera, image arc, kind, length (px), contrast (grey levels), reason, residual (px; null: none
-- near).
SELECT camera, image_arc_no, kind, length, contrast, reason, residual
FROM rejected_arc
WHERE run_id = :run_id
ORDER BY camera, image_arc_no
