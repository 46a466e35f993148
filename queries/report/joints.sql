-- The joints of each arm that carries a rig, as stated and as corrected.
-- Takes run_id; gives one row a joint; rad or mm.
SELECT w.name AS arm, j.joint, j.stated_value, j.prior_sigma, j.value, j.sigma
FROM joint_correction AS j
JOIN base_correction AS c ON c.run_id = j.run_id AND c.base_no = j.base_no
JOIN placed_object AS w ON w.object_no = c.object_no
WHERE j.run_id = :run_id
ORDER BY j.base_no, j.joint
