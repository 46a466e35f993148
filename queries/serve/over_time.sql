-- Sizes of parts as usable inspections measured them, the oldest first of each, those with limits before all others.
-- Takes path (a piece of it; empty: any), what (empty: any) and newest (of how many inspections); gives quantity (path and what),
-- run, began_at, serial, value, spread (U), nominal, lower and upper (limit; null where there is none), decision, changed (whether it
-- does not conform) and unit.
SELECT concat(c.path, ', ', c.what) AS quantity, c.run_id AS run, r.began_at, i.serial, c.measured AS value,
    c.expanded_uncertainty AS spread, c.nominal, c.lower_limit AS lower, c.upper_limit AS upper, c.decision,
    c.decision = 'does not conform' AS changed, CASE WHEN c.what IN ('count', 'presence') THEN '' ELSE 'mm' END AS unit
FROM characteristic_result AS c
JOIN inspection AS i ON i.run_id = c.run_id
JOIN run AS r ON r.id = c.run_id
WHERE c.measured IS NOT NULL AND CAST(:what AS TEXT) IN ('', c.what) AND strpos(lower(c.path), lower(CAST(:path AS TEXT))) > 0
    AND c.run_id IN (SELECT run_id FROM inspection WHERE verdict = 'accepted' ORDER BY run_id DESC LIMIT :newest)
ORDER BY coalesce(c.lower_limit, c.upper_limit) IS NULL, c.path, c.what, c.run_id
