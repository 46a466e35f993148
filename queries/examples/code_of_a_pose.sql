-- Which code made the newest pose, with which packages and seeds?
SELECT p.run_id, p.verdict, r.code_commit, r.code_sha256, r.schema_revision, r.versions,
    CAST((r.parameters -> 'localisation') ->> 'search_seed' AS INTEGER) AS search_seed,
    CAST((r.parameters -> 'localisation') ->> 'refinement_seed' AS INTEGER) AS refinement_seed
FROM pose AS p
JOIN run AS r ON r.id = p.run_id
WHERE p.run_id = (SELECT max(pose.run_id) FROM pose)
