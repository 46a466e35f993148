-- What is there and what is not: parts and features that the view should show, those first that are not as modelled.
-- Takes run_id; gives one row a part or feature.
SELECT path, level, state, reason, log_odds, expected_log_odds, distinct_px, supported_px, moved_mm, moved_sigma_mm
FROM presence
WHERE run_id = :run_id AND level <> 'surface'
ORDER BY CASE state WHEN 'contradicted' THEN 0 WHEN 'changed' THEN 1 WHEN 'not_confirmed' THEN 2 WHEN 'undecidable' THEN 3
    ELSE 4 END, level DESC, item_no
