-- What the pictures of an inspection are like.
-- Takes run; gives camera, edges, blur_px, saturated and stale_run_id.
SELECT camera, edges, blur_px, saturated, stale_run_id FROM inspection_image WHERE run_id = :run ORDER BY camera
