-- What the pictures show where the model shows nothing.
-- Takes run_id; gives camera, kind, image arc or region, its bounds and length (px), contrast (grey levels).
SELECT camera, kind, image_arc_no, region_no, u0, v0, u1, v1, length, contrast, beyond
FROM unexplained
WHERE run_id = :run_id
ORDER BY unexplained_no
