-- Parts and features in view that are not as the model says, the worst first: by state, then by evidence.
-- Takes run_id; gives in_view_no, item_no, path and state; a part that fails by its features alone is left out.
SELECT v.in_view_no, p.item_no, p.path, p.state
FROM presence AS p
JOIN part_in_view AS v ON v.run_id = p.run_id AND v.occurrence_id = p.occurrence_id AND v.level = p.level
    AND v.feature_no IS NOT DISTINCT FROM p.feature_no
WHERE p.run_id = :run_id AND p.level <> 'surface' AND p.state IN ('contradicted', 'changed', 'not_confirmed')
    AND p.reason <> 'a feature of it is not as modelled'
ORDER BY CASE p.state WHEN 'contradicted' THEN 0 WHEN 'changed' THEN 1 ELSE 2 END,
    greatest(-p.log_odds, coalesce(p.moved_log_odds, 0)) DESC, p.item_no
