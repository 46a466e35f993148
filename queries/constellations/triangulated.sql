-- Matched arcs of a stereo problem in space.
-- Takes run and problem_no; gives unit_no, label_no, curve, edge_probability, the ends start and end and their
-- covariance (36), of circles and ellipses centre, major and minor (x, y, z each, mm, in the rig's frame) and
-- conic_covariance (49).
SELECT t.unit_no, a.label_no, t.curve, t.edge_probability, t.start_x, t.start_y, t.start_z, t.end_x, t.end_y, t.end_z,
    t.covariance, t.centre_x, t.centre_y, t.centre_z, t.major_x, t.major_y, t.major_z, t.minor_x, t.minor_y, t.minor_z,
    t.conic_covariance
FROM triangulated_unit AS t
JOIN assignment AS a ON a.run_id = t.run_id AND a.problem_no = t.problem_no AND a.unit_no = t.unit_no
WHERE t.run_id = :run AND t.problem_no = :problem_no
ORDER BY t.unit_no
