-- Placed parts and features that the cameras see at the pose found.
-- Takes run_id; gives path, level, and the pixels that it shows and would show with nothing before it.
SELECT path, level, feature_no, visible_pixels, covered_pixels
FROM part_in_view
WHERE run_id = :run_id
ORDER BY in_view_no
