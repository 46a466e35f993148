-- Where the search of a pose started: at poses of the join of circles or straight edges, with the margin to the next,
-- or in a scan.
-- Takes run; gives sentence.
WITH joined AS (
    SELECT pose_no, score, stage
    FROM search_pose
    WHERE run_id = :run AND stage IN ('join', 'lines')
),
best AS (
    SELECT count(*) AS poses, CASE WHEN max(stage) = 'lines' THEN 'straight edges or circles' ELSE 'circles' END AS seen, max(score) AS first_score, max(CASE WHEN pose_no = 1 THEN score END) AS next_score
    FROM joined
),
seen AS (
    SELECT count(*) AS cameras FROM inspection_image WHERE run_id = :run
),
scanned AS (
    SELECT count(*) AS scans FROM search_pose WHERE run_id = :run AND stage = 'scan'
)
SELECT concat(
    CASE
        WHEN b.poses = 0 THEN 'no edges of the model lie to each other as those that the pictures show'
        WHEN s.cameras > 1 THEN concat(b.seen, ' in the pictures lie to each other as the model''s do at ', b.poses,
            ' distinct poses: the best explains ', CAST(100 * b.first_score AS NUMERIC(18, 0)),
            ' percent of what stereo puts in space',
            CASE WHEN b.poses = 1 THEN ''
                ELSE concat(', the next ', CAST(100 * b.next_score AS NUMERIC(18, 0)), ' percent') END)
        ELSE concat('ellipses in the picture lie to each other as the model''s circles do at ', b.poses,
            ' distinct poses: the best explains them with log odds of ', CAST(b.first_score AS NUMERIC(18, 0)),
            CASE WHEN b.poses = 1 THEN '' ELSE concat(', the next of ', CAST(b.next_score AS NUMERIC(18, 0))) END)
    END,
    CASE WHEN c.scans > 0 THEN '; the volume of the prior was scanned' ELSE '' END) AS sentence
FROM best AS b
CROSS JOIN seen AS s
CROSS JOIN scanned AS c
WHERE b.poses > 0 OR c.scans > 0
