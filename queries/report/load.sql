-- What a load added.
-- Takes run_id; gives no row or one.
SELECT v.name AS object, v.variant, v.revision, r.status, r.parts, r.occurrences, r.faces_in_file, r.faces_loaded,
    r.shapes_added, r.surfaces_added, r.arcs_added
FROM load_report AS r
LEFT JOIN object_variant AS v ON v.id = r.object_variant_id
WHERE r.run_id = :run_id
