-- Matching problems whose assignment is none, or does not cost what is stored.
-- Takes nothing; gives run_id, problem_no, what does not follow, and how many rows say so.
-- A unit with a label pays the cost of the candidate and of each of its relations the weight less what the neighbour's
-- label saves; one without pays its null cost.  Costs may be real: they agree to six digits.
WITH confirmed AS MATERIALIZED (
    SELECT r.run_id, r.problem_no, r.unit_no, r.neighbour_no, c.saves
    FROM problem_relation AS r
    JOIN assignment AS a ON a.run_id = r.run_id AND a.problem_no = r.problem_no AND a.unit_no = r.unit_no
    JOIN assignment AS b ON b.run_id = r.run_id AND b.problem_no = r.problem_no AND b.unit_no = r.neighbour_no
    JOIN compatibility AS c ON c.run_id = r.run_id AND c.problem_no = r.problem_no
        AND c.unit_a = least(r.unit_no, r.neighbour_no) AND c.unit_b = greatest(r.unit_no, r.neighbour_no)
        AND c.label_a = CASE WHEN r.unit_no < r.neighbour_no THEN a.label_no ELSE b.label_no END
        AND c.label_b = CASE WHEN r.unit_no < r.neighbour_no THEN b.label_no ELSE a.label_no END
),
error_sum AS MATERIALIZED (
    SELECT r.run_id, r.problem_no, r.unit_no, sum(r.weight - least(r.weight, coalesce(c.saves, 0))) AS weight
    FROM problem_relation AS r
    JOIN assignment AS a ON a.run_id = r.run_id AND a.problem_no = r.problem_no AND a.unit_no = r.unit_no
    LEFT JOIN confirmed AS c ON c.run_id = r.run_id AND c.problem_no = r.problem_no
        AND c.unit_no = r.unit_no AND c.neighbour_no = r.neighbour_no
    WHERE a.label_no IS NOT NULL
    GROUP BY r.run_id, r.problem_no, r.unit_no
),
paid AS MATERIALIZED (
    SELECT a.run_id, a.problem_no, a.unit_no, a.label_no, a.cost AS stored,
        CASE WHEN a.label_no IS NULL THEN a.null_cost ELSE c.cost + coalesce(e.weight, 0) END AS cost
    FROM assignment AS a
    LEFT JOIN candidate AS c
        ON c.run_id = a.run_id AND c.problem_no = a.problem_no AND c.unit_no = a.unit_no AND c.label_no = a.label_no
    LEFT JOIN error_sum AS e ON e.run_id = a.run_id AND e.problem_no = a.problem_no AND e.unit_no = a.unit_no
),
found AS MATERIALIZED (
    SELECT run_id, problem_no, 'a label is no candidate of its unit' AS what, count(*) AS times
    FROM paid WHERE cost IS NULL GROUP BY run_id, problem_no
    UNION ALL
    SELECT run_id, problem_no, 'the cost of a decision', count(*)
    FROM paid WHERE abs(stored - cost) > 1e-6 * (1 + abs(cost)) GROUP BY run_id, problem_no
    UNION ALL
    SELECT p.run_id, p.problem_no, 'the cost of the problem', 1
    FROM problem AS p
    LEFT JOIN paid AS d ON d.run_id = p.run_id AND d.problem_no = p.problem_no
    GROUP BY p.run_id, p.problem_no, p.cost
    HAVING abs(p.cost - coalesce(sum(d.cost), 0)) > 1e-6 * (1 + abs(p.cost))
    UNION ALL
    SELECT run_id, problem_no, 'a label is taken twice', count(*)
    FROM (
        SELECT a.run_id, a.problem_no, a.label_no
        FROM assignment AS a
        JOIN problem AS p ON p.run_id = a.run_id AND p.problem_no = a.problem_no
        WHERE p.injective AND a.label_no IS NOT NULL
        GROUP BY a.run_id, a.problem_no, a.label_no
        HAVING count(*) > 1
    ) AS twice
    GROUP BY run_id, problem_no
    UNION ALL
    SELECT u.run_id, u.problem_no, 'a unit has no decision', count(*)
    FROM (
        SELECT run_id, problem_no, unit_no FROM candidate
        UNION
        SELECT run_id, problem_no, unit_no FROM problem_relation
        UNION
        SELECT run_id, problem_no, neighbour_no FROM problem_relation
    ) AS u
    LEFT JOIN assignment AS a ON a.run_id = u.run_id AND a.problem_no = u.problem_no AND a.unit_no = u.unit_no
    WHERE a.unit_no IS NULL
    GROUP BY u.run_id, u.problem_no
    UNION ALL
    SELECT run_id, problem_no, 'a relation is there twice', count(*)
    FROM (
        SELECT run_id, problem_no FROM problem_relation
        GROUP BY run_id, problem_no, unit_no, neighbour_no HAVING count(*) > 1
    ) AS twice
    GROUP BY run_id, problem_no
)
SELECT run_id, problem_no, what, times FROM found ORDER BY run_id, problem_no, what
