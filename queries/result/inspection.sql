-- What an inspection was asked and what it answered, one row.
-- Takes run_id; gives when it was, the world, the verdict, what is not as modelled, how surely, what was needed, and
-- world_from_rig as m00 .. m23 with its covariance (36 numbers, row-major, of a right perturbation in the rig's frame,
-- mm then rad).
SELECT
    r.id AS run, r.began_at, e.seconds, w.name AS world, w.revision AS world_revision, o.verdict, p.reason, p.posterior,
    o.outcome, o.pose_verdict, o.part_verdict, o.findings, o.checked, o.in_view, o.changed, o.contradicted, o.not_confirmed, o.undecidable, o.variant,
    i.needs_translation_mm, i.needs_rotation AS needs_rotation_rad, p.cost, p.margin, p.evidence_ratio,
    p.m00, p.m01, p.m02, p.m03, p.m10, p.m11, p.m12, p.m13, p.m20, p.m21, p.m22, p.m23, p.covariance
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
JOIN world AS w ON w.id = i.world_id
JOIN pose AS p ON p.run_id = i.run_id
JOIN inspection_outcome AS o ON o.run_id = i.run_id
LEFT JOIN run_event AS e ON e.run_id = i.run_id AND e.kind = 'ended'
WHERE i.run_id = :run_id
