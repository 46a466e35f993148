-- What a run matched between its pictures.
-- Takes run; gives name and value.
SELECT concat(p.kind, ' ', p.problem_no, ' matched') AS name, CAST(count(a.label_no) AS TEXT) AS value
FROM problem AS p
JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no
WHERE p.run_id = :run
GROUP BY p.kind, p.problem_no
UNION ALL
SELECT concat(p.kind, ' ', p.problem_no, ' pairs'),
    md5(string_agg(concat(a.unit_no, ':', a.label_no, ':', a.cost), ' ' ORDER BY a.unit_no))
FROM problem AS p
JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no
WHERE p.run_id = :run
GROUP BY p.kind, p.problem_no
