-- The surfaces that regions of the pictures were matched to.
-- Takes run_id; gives one row a pair that was taken: share of the surface that the region covers.
SELECT v.camera, m.region_no, o.path, s.surface_no, m.surface_share
FROM surface_match AS m
JOIN view_surface AS s ON s.run_id = m.run_id AND s.view_no = m.view_no AND s.view_surface_no = m.view_surface_no
JOIN inspection_image AS v ON v.run_id = m.run_id AND v.view_no = m.view_no
JOIN placed_node AS o ON o.id = s.occurrence_id
WHERE m.run_id = :run_id AND m.accepted
ORDER BY v.camera, m.region_no, s.surface_no
