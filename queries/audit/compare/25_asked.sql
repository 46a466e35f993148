-- Options of a run, without its files.
-- Takes run; gives name and value.
SELECT 'world' AS name, concat(w.name, ' revision ', w.revision) AS value
FROM inspection AS i
JOIN world AS w ON w.id = i.world_id
WHERE i.run_id = :run
UNION ALL
SELECT 'needs', concat(needs_translation_mm, ' mm, ', needs_rotation, ' rad') FROM inspection WHERE run_id = :run
UNION ALL
SELECT 'prior', concat_ws(' ', m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23) FROM inspection
WHERE run_id = :run
