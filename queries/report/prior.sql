-- Where the rig was thought to be, how surely (standard deviations along and about its own axes), and how exactly the
-- pose was needed (two standard deviations).
-- Takes run_id; gives no row or one; mm, degrees.
SELECT w.name AS world, w.revision, i.m03 AS x, i.m13 AS y, i.m23 AS z,
    sqrt(i.prior_covariance[1]) AS sigma_x, sqrt(i.prior_covariance[8]) AS sigma_y,
    sqrt(i.prior_covariance[15]) AS sigma_z, degrees(sqrt(i.prior_covariance[22])) AS sigma_rx_deg,
    degrees(sqrt(i.prior_covariance[29])) AS sigma_ry_deg, degrees(sqrt(i.prior_covariance[36])) AS sigma_rz_deg,
    i.needs_translation_mm, degrees(i.needs_rotation) AS needs_rotation_deg,
    (SELECT count(*) FROM selected_part AS s WHERE s.run_id = i.run_id) AS selected_parts,
    (SELECT count(*) FROM selected_part AS s WHERE s.run_id = i.run_id AND NOT s.shown) AS superfluous_parts
FROM inspection AS i
JOIN world AS w ON w.id = i.world_id
WHERE i.run_id = :run_id
