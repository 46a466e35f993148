-- The parts and features in view, with how many of their model arcs there are and were matched, over all cameras.
-- Takes run_id; gives one row a part or feature, in order; visible is the share that is not covered; state, reason
-- and item_no null where the run did not look what is there.
WITH arc AS (
    SELECT DISTINCT p.in_view_no, a.view_no, a.view_arc_no
    FROM part_in_view AS p
    JOIN placed_node AS o ON o.id = p.occurrence_id
    JOIN view_arc AS a ON a.run_id = p.run_id AND a.occurrence_id = p.occurrence_id
    LEFT JOIN shape_arc AS h ON h.shape_id = o.shape_id AND h.arc_no = a.arc_no
    LEFT JOIN feature_surface AS f ON f.shape_id = o.shape_id AND f.feature_no = p.feature_no
        AND (f.surface_no = h.surface_a OR f.surface_no = h.surface_b OR f.surface_no = a.surface_no)
    WHERE p.run_id = :run_id AND (p.level = 'part' OR f.surface_no IS NOT NULL)
),
matched AS (
    SELECT DISTINCT view_no, view_arc_no
    FROM correspondence
    WHERE run_id = :run_id AND hypothesis_no = 0 AND accepted
),
counted AS (
    SELECT arc.in_view_no, count(*) AS arcs, count(matched.view_arc_no) AS matched
    FROM arc
    LEFT JOIN matched ON matched.view_no = arc.view_no AND matched.view_arc_no = arc.view_arc_no
    GROUP BY arc.in_view_no
)
SELECT p.in_view_no, p.level, p.path, p.occurrence_id, p.feature_no, p.visible_pixels AS pixels,
    p.visible_pixels / p.covered_pixels AS visible, coalesce(c.arcs, 0) AS arcs, coalesce(c.matched, 0) AS matched, s.state, s.reason,
    s.item_no
FROM part_in_view AS p
LEFT JOIN counted AS c ON c.in_view_no = p.in_view_no
LEFT JOIN presence AS s ON s.run_id = p.run_id AND s.occurrence_id = p.occurrence_id AND s.level = p.level
    AND s.feature_no IS NOT DISTINCT FROM p.feature_no
WHERE p.run_id = :run_id
ORDER BY p.in_view_no
