-- The state that each model arc of a view is drawn in: the worst of the features that it bounds, of those that are
-- decided; without any, the part's.
-- Takes run_id; gives one row an arc: camera, view_arc_no, state.
WITH said AS (
    SELECT v.camera, a.view_arc_no, p.state, CASE WHEN p.level = 'part' THEN 10 ELSE 0 END
        + CASE p.state WHEN 'contradicted' THEN 0 WHEN 'changed' THEN 1 WHEN 'not_confirmed' THEN 2 WHEN 'confirmed' THEN 3
            ELSE 4 END AS place
    FROM (
        -- A part that fails by its features alone is drawn by its own edges.
        SELECT run_id, level, occurrence_id, feature_no,
            CASE WHEN reason <> 'a feature of it is not as modelled' THEN state WHEN log_odds > 0 THEN 'confirmed' ELSE 'undecidable' END AS state
        FROM presence
    ) AS p
    JOIN placed_node AS o ON o.id = p.occurrence_id
    JOIN view_arc AS a ON a.run_id = p.run_id AND a.occurrence_id = p.occurrence_id
    JOIN inspection_image AS v ON v.run_id = a.run_id AND v.view_no = a.view_no
    LEFT JOIN shape_arc AS h ON h.shape_id = o.shape_id AND h.arc_no = a.arc_no
    LEFT JOIN feature_surface AS f ON f.shape_id = o.shape_id AND f.feature_no = p.feature_no
        AND (f.surface_no = h.surface_a OR f.surface_no = h.surface_b OR f.surface_no = a.surface_no)
    WHERE p.run_id = :run_id AND (p.level = 'part' OR p.level = 'feature' AND f.surface_no IS NOT NULL)
),
ranked AS (
    SELECT camera, view_arc_no, state,
        row_number() OVER (PARTITION BY camera, view_arc_no ORDER BY place, state) AS rank
    FROM said
)
SELECT camera, view_arc_no, state
FROM ranked
WHERE rank = 1
ORDER BY camera, view_arc_no
