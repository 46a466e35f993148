-- What an inspection was given beside its pictures, and what made it.
-- Takes run; gives one row: the prior's world_from_rig as m00 .. m23 and its covariance (36), needs (mm, rad), parameters,
-- versions and code_sha256.
SELECT i.m00, i.m01, i.m02, i.m03, i.m10, i.m11, i.m12, i.m13, i.m20, i.m21, i.m22, i.m23, i.prior_covariance,
    i.needs_translation_mm, i.needs_rotation, CAST(r.parameters AS TEXT) AS parameters,
    CAST(r.versions AS TEXT) AS versions, r.code_sha256
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
WHERE i.run_id = :run
