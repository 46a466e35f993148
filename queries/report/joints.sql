-- The joints of the arm that carries the rig, as stated and as corrected.
-- Takes run_id; gives one row a joint; rad or mm.
SELECT joint, stated_value, prior_sigma, value, sigma
FROM joint_correction
WHERE run_id = :run_id
ORDER BY joint
