-- Pairs of model arc and image arc that the pose rests on, the worst first.
-- Takes run_id; gives camera, placed part, arc or surface in its shape, arc in the view, image arc, residual (px), angle (rad),
-- overlap (px).
SELECT camera, path, view_kind, arc_no, surface_no, view_arc_no, image_arc_no, residual, angle, overlap
FROM matched_arc
WHERE run_id = :run_id
ORDER BY residual DESC, camera, view_arc_no, image_arc_no
