-- Which threshold decided the state of each part and feature in the newest inspection that was not refused, and how near to it was what was found?
SELECT path, state, threshold, threshold_value, found
FROM found_state
WHERE run_id = (SELECT max(found_state.run_id) FROM found_state) AND level <> 'surface' AND threshold IS NOT NULL
ORDER BY abs(found / threshold_value - 1), path
