-- Where the rig was, and how surely.
-- Takes run; gives sentence.
SELECT concat('the rig stands at ', CAST(x AS NUMERIC(18, 3)), ', ', CAST(y AS NUMERIC(18, 3)), ', ',
    CAST(z AS NUMERIC(18, 3)), ' mm in the world, one sigma ', CAST(sigma_x AS NUMERIC(18, 3)), ', ',
    CAST(sigma_y AS NUMERIC(18, 3)), ', ', CAST(sigma_z AS NUMERIC(18, 3)), ' mm along and ',
    CAST(degrees(sigma_rx) AS NUMERIC(18, 4)), ', ', CAST(degrees(sigma_ry) AS NUMERIC(18, 4)), ', ',
    CAST(degrees(sigma_rz) AS NUMERIC(18, 4)), ' degrees about its axes; the pose is ', verdict) AS sentence
FROM pose_world
WHERE run_id = :run
