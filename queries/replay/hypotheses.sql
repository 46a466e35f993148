-- The poses that an inspection refined, with what each gathers over all cameras.
-- Takes run; gives hypothesis_no, the pose as m00 .. m23, cost, distance, evidence_ratio, outlines, evidence, found and
-- expected.
SELECT h.hypothesis_no, h.m00, h.m01, h.m02, h.m03, h.m10, h.m11, h.m12, h.m13, h.m20, h.m21, h.m22, h.m23, h.cost,
    h.distance, h.evidence_ratio, h.outline_length, h.outline_contrast, h.outline_evidence, sum(s.evidence) AS evidence,
    sum(s.found) AS found, sum(s.expected) AS expected
FROM hypothesis AS h
JOIN hypothesis_support AS s ON s.run_id = h.run_id AND s.hypothesis_no = h.hypothesis_no
WHERE h.run_id = :run
GROUP BY h.hypothesis_no, h.m00, h.m01, h.m02, h.m03, h.m10, h.m11, h.m12, h.m13, h.m20, h.m21, h.m22, h.m23, h.cost,
    h.distance, h.evidence_ratio, h.outline_length, h.outline_contrast, h.outline_evidence
ORDER BY h.hypothesis_no
