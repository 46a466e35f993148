-- The parts and features in view, with the model arcs that show them, over all cameras, and how many of these were found.
-- Takes run_id; gives one row a part or feature, in order; visible is the share that is not covered; cameras and arc_nos (its
-- arcs, view_arc_no in the picture of each), surfaces (of a feature) or null; state, drawn, reason, evidence and item_no null
-- where the run did not look what is there.  drawn: the state that its own edges are drawn in, another where a part fails by
-- its features alone.
WITH arc AS (
    SELECT DISTINCT p.in_view_no, v.camera, a.view_arc_no, a.log_odds > 0 AS found
    FROM part_in_view AS p
    JOIN placed_node AS o ON o.id = p.occurrence_id
    JOIN view_arc AS a ON a.run_id = p.run_id AND a.occurrence_id = p.occurrence_id
    JOIN inspection_image AS v ON v.run_id = a.run_id AND v.view_no = a.view_no
    LEFT JOIN shape_arc AS h ON h.shape_id = o.shape_id AND h.arc_no = a.arc_no
    LEFT JOIN feature_surface AS f ON f.shape_id = o.shape_id AND f.feature_no = p.feature_no
        AND (f.surface_no = h.surface_a OR f.surface_no = h.surface_b OR f.surface_no = a.surface_no)
    WHERE p.run_id = :run_id AND (p.level = 'part' OR f.surface_no IS NOT NULL)
),
counted AS (
    SELECT arc.in_view_no, count(*) AS arcs, sum(CASE WHEN arc.found THEN 1 ELSE 0 END) AS found,
        array_agg(arc.camera ORDER BY arc.camera, arc.view_arc_no) AS cameras,
        array_agg(arc.view_arc_no ORDER BY arc.camera, arc.view_arc_no) AS arc_nos
    FROM arc
    GROUP BY arc.in_view_no
)
SELECT p.in_view_no, p.level, p.path, p.occurrence_id, p.feature_no, p.visible_pixels AS pixels,
    p.visible_pixels / p.covered_pixels AS visible, coalesce(c.arcs, 0) AS arcs, coalesce(c.found, 0) AS found, c.cameras, c.arc_nos,
    (SELECT array_agg(f.surface_no ORDER BY f.surface_no) FROM feature_surface AS f JOIN placed_node AS o ON o.shape_id = f.shape_id
        WHERE o.id = p.occurrence_id AND f.feature_no = p.feature_no) AS surfaces,
    s.state, CASE WHEN s.reason NOT LIKE 'a feature of it is %' THEN s.state WHEN s.log_odds > 0 THEN 'confirmed'
        WHEN s.log_odds <= 0 THEN 'undecidable' END AS drawn,
    s.reason, greatest(-s.log_odds, coalesce(s.moved_log_odds, 0)) AS evidence, s.item_no
FROM part_in_view AS p
LEFT JOIN counted AS c ON c.in_view_no = p.in_view_no
LEFT JOIN presence AS s ON s.run_id = p.run_id AND s.occurrence_id = p.occurrence_id AND s.level = p.level
    AND s.feature_no IS NOT DISTINCT FROM p.feature_no
WHERE p.run_id = :run_id
ORDER BY p.in_view_no
