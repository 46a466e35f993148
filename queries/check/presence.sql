-- Items whose evidence is not the sum of the cameras', or whose state contradicts its evidence or its sizes.
-- Takes nothing; gives run_id, item_no and what is wrong.
WITH total AS (
    SELECT c.run_id, c.item_no, sum(c.log_odds) AS log_odds, sum(c.distinct_px) AS distinct_px,
        sum(c.supported_px) AS supported_px, bool_or(c.stopped) AS stopped
    FROM presence_camera AS c
    GROUP BY c.run_id, c.item_no
), another AS (
    SELECT DISTINCT m.run_id, m.item_no FROM measured_size AS m WHERE m.changed AND m.what <> 'distance'
)
SELECT s.run_id, s.item_no, 'cameras do not add up' AS problem
FROM presence AS s
LEFT JOIN total AS t ON t.run_id = s.run_id AND t.item_no = s.item_no
WHERE t.run_id IS NULL OR abs(t.log_odds - s.log_odds) > 1e-6 * (1 + abs(s.log_odds))
    OR abs(t.distinct_px - s.distinct_px) > 1e-6 * (1 + s.distinct_px)
    OR abs(t.supported_px - s.supported_px) > 1e-6 * (1 + s.distinct_px)
UNION ALL
SELECT s.run_id, s.item_no, 'state against the evidence'
FROM presence AS s
LEFT JOIN total AS h ON h.run_id = s.run_id AND h.item_no = s.item_no AND h.stopped
WHERE (s.state = 'confirmed' AND s.log_odds <= 0)
    OR (s.state IN ('contradicted', 'not_confirmed') AND s.log_odds >= 0 AND h.run_id IS NULL AND s.reason NOT IN (
        'an edge of it that should show does not', 'a size of it may differ from the model''s',
        'a feature of it is in doubt', 'what it covers shows in its place'))
    OR (h.run_id IS NOT NULL AND s.state <> 'contradicted')
UNION ALL
SELECT s.run_id, s.item_no, 'state against the sizes'
FROM presence AS s
LEFT JOIN another AS a ON a.run_id = s.run_id AND a.item_no = s.item_no
WHERE (s.state = 'changed' AND a.run_id IS NULL AND s.reason <> 'a feature of it is not as modelled')
    OR (s.state NOT IN ('changed', 'contradicted') AND a.run_id IS NOT NULL)
UNION ALL
SELECT DISTINCT s.run_id, s.item_no, 'a part passes with a feature that fails'
FROM presence AS s
JOIN presence AS f ON f.run_id = s.run_id AND f.occurrence_id = s.occurrence_id AND f.level = 'feature'
    AND f.state IN ('changed', 'contradicted')
WHERE s.level = 'part' AND s.state NOT IN ('changed', 'contradicted')
ORDER BY run_id, item_no, problem
