-- What is seen through it, against what lies behind the object elsewhere.
-- Takes run and path; gives sentence.
SELECT concat('camera ', t.camera, ' sees grey ', CAST(t.through_grey AS NUMERIC(18, 1)), ' through it; elsewhere what lies behind has ',
    CAST(t.behind_grey AS NUMERIC(18, 1)), ' (sigma ', CAST(t.behind_sigma AS NUMERIC(18, 1)), ')',
    CASE WHEN t.stopped THEN ': something stops it' ELSE '' END) AS sentence
FROM presence AS p
JOIN presence_camera AS t ON t.run_id = p.run_id AND t.item_no = p.item_no
WHERE p.run_id = :run AND p.path = :path AND t.stopped IS NOT NULL
ORDER BY t.camera
