-- The poses that a run considered, the best first, and how far each lies from the best.
-- Takes run_id; gives one row a hypothesis; mm, distance_from_prior in standard deviations.
SELECT h.hypothesis_no, h.cost, h.evidence_ratio, h.distance AS distance_from_prior, h.m03 AS x, h.m13 AS y, h.m23 AS z,
    sqrt(power(h.m03 - b.m03, 2) + power(h.m13 - b.m13, 2) + power(h.m23 - b.m23, 2)) AS from_best
FROM hypothesis AS h
JOIN hypothesis AS b ON b.run_id = h.run_id AND b.hypothesis_no = 0
WHERE h.run_id = :run_id
ORDER BY h.hypothesis_no
