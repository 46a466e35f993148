-- Inputs, decisions and code of an inspection, without its poses.
-- Takes run; gives one row: world_id, needs (mm, rad), parameters, versions, code_sha256; verdict, reason, posterior,
-- cost and margin, null where it has no pose; and the middle of what is seen.
SELECT i.world_id, i.needs_translation_mm, i.needs_rotation, CAST(r.parameters AS TEXT) AS parameters,
    CAST(r.versions AS TEXT) AS versions, r.code_sha256, p.verdict, p.reason, p.posterior, p.cost, p.margin,
    i.middle_x, i.middle_y, i.middle_z
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
LEFT JOIN pose AS p ON p.run_id = i.run_id
WHERE i.run_id = :run
