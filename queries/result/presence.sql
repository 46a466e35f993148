-- What is there and what is not: parts, features and surfaces in view, each with a state and what it rests on.
-- Takes run_id; gives path, level, state, the state in the words of QIF, reason, log odds, and how far it has moved
-- (mm).
SELECT
    item_no, path, level, feature_no, surface_no, state, qif, reason, log_odds, expected_log_odds, visible_pixels,
    edge_px, distinct_px, supported_px, moved_mm, moved_sigma_mm
FROM presence
WHERE run_id = :run_id
ORDER BY item_no
