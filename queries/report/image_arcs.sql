-- The arcs of a picture.
-- Takes extraction_id; gives one row an arc, in order; length and ends in px.
SELECT image_arc_no, kind, topography, length, closed, start_x, start_y, end_x, end_y
FROM image_arc
WHERE extraction_id = :extraction_id
ORDER BY image_arc_no
