-- What it looks like, against what is around it and what it would look like.
-- Takes run and path; gives sentence.
SELECT concat('camera ', t.camera, ' sees grey ', CAST(t.inside_grey AS NUMERIC(18, 0)), ' there, ', CAST(t.around_grey AS NUMERIC(18, 0)),
    ' around it; it would have ', CAST(t.like_grey AS NUMERIC(18, 0)), ': log odds ', CAST(t.appearance_log_odds AS NUMERIC(18, 1)),
    CASE WHEN t.stopped THEN '; something stops it' ELSE '' END) AS sentence
FROM presence AS p
JOIN presence_camera AS t ON t.run_id = p.run_id AND t.item_no = p.item_no
WHERE p.run_id = :run AND p.path = :path AND t.stopped IS NOT NULL
ORDER BY t.camera
