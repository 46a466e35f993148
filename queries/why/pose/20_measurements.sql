-- What it was measured on, by camera.
-- Takes run; gives sentence.
SELECT concat('measured on ', points, ' edge elements of ', model_arcs, ' model arcs in the ', camera, ' picture: ',
    CAST(rms_px AS NUMERIC(18, 3)), ' px off (rms, weighted)') AS sentence
FROM camera_residual
WHERE run_id = :run
ORDER BY camera
