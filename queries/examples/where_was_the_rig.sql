-- Where in the world was the rig at the newest inspection, and how sure is that (standard deviations, mm)?
SELECT p.verdict, p.m03 AS x, p.m13 AS y, p.m23 AS z,
    sqrt(p.covariance[1]) AS sigma_x, sqrt(p.covariance[8]) AS sigma_y, sqrt(p.covariance[15]) AS sigma_z
FROM pose AS p
WHERE p.run_id = (SELECT max(run.id) FROM run WHERE run.kind = 'inspect')
