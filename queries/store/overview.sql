-- What a store holds: objects with their variants, worlds, and inspections by how the part is.
-- Takes nothing; gives what, name, and which: variants, revision, or how many inspections and the newest.
SELECT 'object' AS what, v.name, string_agg(DISTINCT CASE v.variant WHEN '' THEN 'no variant' ELSE concat('variant ', v.variant) END, ', ') AS which
FROM object_variant AS v
GROUP BY v.name
UNION ALL
SELECT 'world', name, concat('revision ', revision)
FROM current_world
UNION ALL
SELECT 'inspections', concat('pose ', pose_verdict, ', part ', part_verdict), concat(count(*), ', the newest run ', max(run_id))
FROM inspection_outcome
GROUP BY pose_verdict, part_verdict
ORDER BY what DESC, name
