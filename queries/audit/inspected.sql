-- What an inspection was given, and the code that made it.
-- Takes run; gives world_id, world (its name), is_newest (whether that is still the world's newest revision), rig_id, the
-- prior as m00 .. m23 and prior_covariance (null: none), is_given (whether a file stated that, no arm), needs (mm, rad),
-- code_sha256, and parameters and versions as JSON.
SELECT i.world_id, w.name AS world, c.world_id IS NOT NULL AS is_newest, i.rig_id,
    i.m00, i.m01, i.m02, i.m03, i.m10, i.m11, i.m12, i.m13, i.m20, i.m21, i.m22, i.m23, i.prior_covariance,
    EXISTS (SELECT 1 FROM run_input AS n WHERE n.run_id = i.run_id AND n.role = 'prior') AS is_given,
    i.needs_translation_mm, i.needs_rotation, r.code_sha256, CAST(r.parameters AS TEXT) AS parameters,
    CAST(r.versions AS TEXT) AS versions
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
JOIN world AS w ON w.id = i.world_id
LEFT JOIN current_world AS c ON c.world_id = i.world_id
WHERE i.run_id = :run
