-- What the pictures show where the model shows nothing, the most telling first.
-- Takes run_id; gives one row an arc or region of a picture: px.
SELECT camera, image_arc_no, region_no, kind, length, contrast, beyond
FROM unexplained
WHERE run_id = :run_id
ORDER BY unexplained_no
