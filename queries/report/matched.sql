-- The model arcs that were matched to arcs of the pictures, the worst first.
-- Takes run_id; gives one row a pair; residual in px, angle in degrees.
SELECT camera, path, view_kind AS kind, arc_no, surface_no, view_arc_no, image_arc_no, residual,
    degrees(angle) AS angle_deg, overlap
FROM matched_arc
WHERE run_id = :run_id
ORDER BY residual DESC, camera, view_arc_no, image_arc_no
