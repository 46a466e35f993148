-- Pairs of model arc and image arc that the pose rests on.
-- Takes run_id; gives camera, placed part, arc or surface in its shape, image arc, residual (px), angle (rad), overlap
-- (px).
SELECT camera, path, view_kind, arc_no, surface_no, image_arc_no, residual, angle, overlap
FROM matched_arc
WHERE run_id = :run_id
ORDER BY camera, view_arc_no, image_arc_no
