-- Which files were loaded as what, and what did each add?
SELECT v.name, v.variant, v.revision, s.file_name, r.status, r.surfaces_added
FROM load_report AS r
JOIN object_variant AS v ON v.id = r.object_variant_id
JOIN source AS s ON s.id = r.source_id
ORDER BY r.run_id
