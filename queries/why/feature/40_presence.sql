-- What state it was given, by which evidence, and what each camera says.
-- Takes run and path; gives sentence.
WITH item AS (
    SELECT *
    FROM presence
    WHERE run_id = :run AND path = :path
)
SELECT sentence
FROM (
    SELECT item_no, '' AS camera, concat('it is ', CASE state WHEN 'not_confirmed' THEN 'not confirmed' ELSE state END,
        ' (', qif, '): ', reason, '; log odds of ', CAST(log_odds AS NUMERIC(18, 1)), ' for its being there, ',
        CAST(expected_log_odds AS NUMERIC(18, 1)), ' were expected',
        '; log odds of ', CAST(absent_log_odds AS NUMERIC(18, 1)), ' that some of its edges are not there',
        '; log odds of ' || CAST(CAST(uncovered_log_odds AS NUMERIC(18, 1)) AS TEXT) || ' that what it covers shows in its place'
        ) AS sentence
    FROM item
    UNION ALL
    SELECT c.item_no, c.camera, concat('the ', c.camera, ' picture: log odds of ', CAST(c.log_odds AS NUMERIC(18, 1)),
        ' of ', CAST(c.expected_log_odds AS NUMERIC(18, 1)), ' expected; edges found on ',
        CAST(c.supported_px AS NUMERIC(18, 0)), ' of ', CAST(c.distinct_px AS NUMERIC(18, 0)),
        ' px that can be distinguished from others, of ', CAST(c.edge_px AS NUMERIC(18, 0)), ' px in view')
    FROM item AS i
    JOIN presence_camera AS c ON c.run_id = i.run_id AND c.item_no = i.item_no
) AS said
ORDER BY item_no, camera
