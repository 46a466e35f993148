-- Which files were loaded as what, and what did each add?
SELECT object, variant, revision, file, status, surfaces_added, findings
FROM loaded_file
ORDER BY run_id
