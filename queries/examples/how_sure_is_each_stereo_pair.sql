-- How much dearer, at least, is every matching without a pair of arcs that stereo took, where bounds were last kept?
WITH asked AS (
    SELECT p.run_id, p.problem_no, p.units_id, p.labels_id, p.cost, coalesce(p.dual_scale, 1) AS dual_scale, n.proof_no
    FROM problem AS p
    JOIN search_node AS n ON n.run_id = p.run_id AND n.problem_no = p.problem_no AND n.branch = 'root'
    WHERE p.kind = 'stereo' AND p.run_id = (SELECT max(problem.run_id) FROM problem WHERE problem.kind = 'stereo' AND problem.bound_kept)
),
state AS (  -- what each partner of an arc costs, and none, if no relation confirms it
    SELECT c.unit_no, c.label_no, c.cost + coalesce(r.weight, 0) AS cost
    FROM asked AS p
    JOIN candidate AS c ON c.run_id = p.run_id AND c.problem_no = p.problem_no
    LEFT JOIN (
        SELECT run_id, problem_no, unit_no, sum(weight) AS weight
        FROM problem_relation
        GROUP BY run_id, problem_no, unit_no
    ) AS r ON r.run_id = c.run_id AND r.problem_no = c.problem_no AND r.unit_no = c.unit_no
    UNION ALL
    SELECT a.unit_no, NULL, a.null_cost
    FROM asked AS p
    JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no
),
price AS (
    SELECT b.label_no, b.dual
    FROM asked AS p
    JOIN bound_price AS b ON b.run_id = p.run_id AND b.problem_no = p.problem_no AND b.node_no = p.proof_no
),
reduced AS (  -- that less what the proof credits to it
    SELECT s.unit_no, s.label_no,
        p.dual_scale * s.cost - coalesce(m.dual, 0) - coalesce(q.dual, 0) AS cost
    FROM asked AS p
    CROSS JOIN state AS s
    LEFT JOIN price AS q ON q.label_no = s.label_no
    LEFT JOIN (
        SELECT run_id, problem_no, node_no, unit_no, label_no, sum(dual) AS dual
        FROM bound_message
        GROUP BY run_id, problem_no, node_no, unit_no, label_no
    ) AS m ON m.run_id = p.run_id AND m.problem_no = p.problem_no AND m.node_no = p.proof_no
        AND m.unit_no = s.unit_no AND m.label_no = s.label_no
),
least AS (
    SELECT unit_no, min(cost) AS cost
    FROM reduced
    GROUP BY unit_no
),
proved AS (  -- no matching costs less
    SELECT (SELECT sum(cost) FROM least) + coalesce((SELECT sum(dual) FROM price), 0) AS cost
),
other AS (
    SELECT a.unit_no, min(r.cost) AS cost
    FROM asked AS p
    JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no
    JOIN reduced AS r ON r.unit_no = a.unit_no AND coalesce(r.label_no, -1) <> coalesce(a.label_no, -1)
    GROUP BY a.unit_no
)
SELECT p.run_id, u.ref_no AS left_arc, v.ref_no AS right_arc, a.cost,
    greatest((b.cost + o.cost - l.cost) / p.dual_scale - p.cost, 0) AS dearer
FROM asked AS p
CROSS JOIN proved AS b
JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no
JOIN unit AS u ON u.unit_set_id = p.units_id AND u.unit_no = a.unit_no AND u.kind = 'arc'
JOIN unit AS v ON v.unit_set_id = p.labels_id AND v.unit_no = a.label_no
JOIN other AS o ON o.unit_no = a.unit_no
JOIN least AS l ON l.unit_no = a.unit_no
ORDER BY dearer, left_arc
