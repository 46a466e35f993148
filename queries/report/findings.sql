-- What a load found to be not as it should be.
-- Takes run_id; gives one row a finding, in order.
SELECT f.kind, f.message, p.number AS part, f.value, f.bound, f.unit
FROM load_finding AS f
LEFT JOIN part AS p ON p.id = f.part_id
WHERE f.run_id = :run_id
ORDER BY f.finding_no
