-- Which threshold decided the state of each part and feature in the newest inspection that was not refused, and how near to it was what was found?
WITH held AS (
    SELECT s.path, s.state, t.name AS threshold, t.value AS held_against,
        CASE t.name WHEN 'states.least_px' THEN s.told_px WHEN 'states.least_expected' THEN s.expected_log_odds
            ELSE abs(s.log_odds) END AS found
    FROM presence AS s
    JOIN threshold AS t ON t.run_id = s.run_id AND t.decision = 'presence' AND t.name = CASE s.reason
        WHEN 'its edges are found' THEN 'states.least_log_odds'
        WHEN 'some of its edges are found, some are not' THEN 'states.least_log_odds'
        WHEN 'none of its edges is found, which so few may hide' THEN 'states.least_log_odds'
        WHEN 'its edges are found, which may be chance' THEN 'states.least_log_odds'
        WHEN 'its edges are not found, where they would show' THEN
            CASE s.state WHEN 'contradicted' THEN 'states.contradicted_log_odds' ELSE 'states.least_log_odds' END
        WHEN 'little contrast is expected of its edges' THEN 'states.least_expected'
        WHEN 'its edges are too short in the picture' THEN 'states.least_px'
        WHEN 'its edges lie too near to others or to the picture''s border' THEN 'states.least_px'
    END
    WHERE s.run_id = (SELECT max(presence.run_id) FROM presence) AND s.level <> 'surface'
)
SELECT path, state, threshold, held_against, found
FROM held
ORDER BY abs(found / held_against - 1), path
