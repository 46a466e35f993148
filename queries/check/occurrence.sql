-- Rows of runs that point at an occurrence which is not there.
-- Takes nothing; gives relation, run_id and occurrence_id.
SELECT said.relation, said.run_id, said.occurrence_id
FROM (
    SELECT DISTINCT 'selected_part' AS relation, run_id, occurrence_id FROM selected_part
    UNION ALL
    SELECT DISTINCT 'view_arc', run_id, occurrence_id FROM view_arc
    UNION ALL
    SELECT DISTINCT 'view_surface', run_id, occurrence_id FROM view_surface
    UNION ALL
    SELECT DISTINCT 'part_in_view', run_id, occurrence_id FROM part_in_view
    UNION ALL
    SELECT DISTINCT 'presence', run_id, occurrence_id FROM presence
) AS said
LEFT JOIN placed_node AS o ON o.id = said.occurrence_id
WHERE o.id IS NULL
ORDER BY 1, 2, 3
