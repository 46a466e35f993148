-- The findings of a physical part that still count, each once, the worst first.
-- Takes serial; gives one row a finding: the inspection that it is of, and all that finding says of it.
SELECT f.*
FROM serial_finding AS s
JOIN finding AS f ON f.run_id = s.run_id AND f.finding_no = s.finding_no
WHERE s.serial = :serial
ORDER BY CASE f.state WHEN 'contradicted' THEN 0 ELSE 1 END, f.evidence DESC, f.run_id, f.finding_no
