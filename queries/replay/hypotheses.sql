-- The poses that an inspection refined, with what each gathers over all cameras.
-- Takes run; gives the pose as m00 .. m23, cost, distance, evidence_ratio, outlines, is_symmetric,
-- relational_distance, evidence, found and expected.
SELECT h.m00, h.m01, h.m02, h.m03, h.m10, h.m11, h.m12, h.m13, h.m20, h.m21, h.m22, h.m23, h.cost, h.distance,
    h.evidence_ratio, h.outline_length, h.outline_contrast, h.outline_evidence, h.is_symmetric,
    h.relational_distance, s.evidence, s.found, s.expected
FROM hypothesis AS h
JOIN (
    SELECT hypothesis_no, sum(evidence) AS evidence, sum(found) AS found, sum(expected) AS expected
    FROM hypothesis_support WHERE run_id = :run GROUP BY hypothesis_no
) AS s ON s.hypothesis_no = h.hypothesis_no
WHERE h.run_id = :run
ORDER BY h.hypothesis_no
