-- What it was measured on, by camera.
-- Takes run; gives sentence.
SELECT concat('measured on ', count(*), ' edge elements of ', count(DISTINCT m.view_arc_no), ' model arcs in the ',
    v.camera, ' picture: ', CAST(sqrt(sum(m.weight * m.residual * m.residual) / sum(m.weight)) AS NUMERIC(18, 3)),
    ' px off (rms, weighted)') AS sentence
FROM edge_measurement AS m
JOIN view AS v ON v.run_id = m.run_id AND v.view_no = m.view_no
WHERE m.run_id = :run AND m.weight > 0
GROUP BY v.view_no, v.camera
ORDER BY v.view_no
