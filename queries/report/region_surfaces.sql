-- The surfaces that regions of the pictures were matched to.
-- Takes run_id; gives camera, region_no and surfaces, a text.
SELECT v.camera, m.region_no, string_agg(concat('surface ', s.surface_no, ' of ', o.path), ', ' ORDER BY s.surface_no, o.path) AS surfaces
FROM surface_match AS m
JOIN view_surface AS s ON s.run_id = m.run_id AND s.view_no = m.view_no AND s.view_surface_no = m.view_surface_no
JOIN inspection_image AS v ON v.run_id = m.run_id AND v.view_no = m.view_no
JOIN placed_node AS o ON o.id = s.occurrence_id
WHERE m.run_id = :run_id AND m.accepted
GROUP BY v.camera, m.region_no
ORDER BY v.camera, m.region_no
