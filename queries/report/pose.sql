-- The verdict of an inspection, with what is not as modelled, and the pose of the rig, with standard deviations along
-- and about the world's axes.
-- Takes run_id; gives no row or one; mm, degrees.
SELECT o.verdict, o.pose_verdict, o.part_verdict, o.mood, o.outcome, p.reason, p.posterior, w.x, w.y, w.z, w.sigma_x, w.sigma_y, w.sigma_z,
    degrees(w.sigma_rx) AS sigma_rx_deg, degrees(w.sigma_ry) AS sigma_ry_deg, degrees(w.sigma_rz) AS sigma_rz_deg,
    p.cost, p.margin, p.evidence_ratio
FROM pose AS p
JOIN pose_world AS w ON w.run_id = p.run_id
JOIN inspection_outcome AS o ON o.run_id = p.run_id
WHERE p.run_id = :run_id
