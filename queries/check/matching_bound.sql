-- Matching problems whose bound does not follow from the stored certificate, where that is kept.
-- Takes nothing; gives run_id, problem_no, what does not follow, and how many rows say so.
-- The nodes of the search split the labellings; each that was not split is bounded by its own or its parent's duals.
-- Duals bound a node if labels cost at most 0, messages are at least 0, and the two messages of any pair of compatible
-- candidates that the node allows add up to what the pair saves.  The bound is then the sum of the label duals and of
-- the least reduced cost of each unit: cost of a state that the node allows, all its relations unconfirmed, less its
-- messages and the dual of its label.  A child that takes one state adds what that costs above its unit's least.
-- Each step is materialised: PostgreSQL would compute it again for every row that asks.
WITH RECURSIVE proof AS MATERIALIZED (
    SELECT DISTINCT n.run_id, n.problem_no, n.proof_no AS node_no
    FROM search_node AS n
    JOIN problem AS p ON p.run_id = n.run_id AND p.problem_no = n.problem_no
    WHERE p.bound_kept
),
above AS (
    SELECT p.run_id, p.problem_no, p.node_no, n.node_no AS above_no, n.parent_no, n.branch, n.unit_no, n.label_no
    FROM proof AS p
    JOIN search_node AS n ON n.run_id = p.run_id AND n.problem_no = p.problem_no AND n.node_no = p.node_no
    UNION ALL
    SELECT a.run_id, a.problem_no, a.node_no, n.node_no, n.parent_no, n.branch, n.unit_no, n.label_no
    FROM above AS a
    JOIN search_node AS n ON n.run_id = a.run_id AND n.problem_no = a.problem_no AND n.node_no = a.parent_no
    WHERE a.parent_no < a.above_no
),
relations AS MATERIALIZED (
    SELECT run_id, problem_no, unit_no, sum(weight) AS weight
    FROM problem_relation GROUP BY run_id, problem_no, unit_no
),
state AS MATERIALIZED (
    SELECT c.run_id, c.problem_no, c.unit_no, c.label_no, c.cost + coalesce(r.weight, 0) AS cost
    FROM candidate AS c
    LEFT JOIN relations AS r ON r.run_id = c.run_id AND r.problem_no = c.problem_no AND r.unit_no = c.unit_no
    UNION ALL
    SELECT run_id, problem_no, unit_no, NULL, null_cost FROM assignment
),
forbidden AS MATERIALIZED (
    -- A label for a unit, or a unit's label for others, taken above.
    SELECT a.run_id, a.problem_no, a.node_no, s.unit_no, coalesce(s.label_no, -1) AS label_no
    FROM above AS a
    JOIN problem AS p ON p.run_id = a.run_id AND p.problem_no = a.problem_no
    JOIN state AS s ON s.run_id = a.run_id AND s.problem_no = a.problem_no
        AND ((s.unit_no = a.unit_no AND coalesce(s.label_no, -1) <> coalesce(a.label_no, -1))
            OR (s.unit_no <> a.unit_no AND p.injective AND s.label_no = a.label_no))
    WHERE a.branch = 'take'
    UNION
    -- What the takes beside a rest above hold.
    SELECT a.run_id, a.problem_no, a.node_no, t.unit_no, coalesce(t.label_no, -1)
    FROM above AS a
    JOIN search_node AS t
        ON t.run_id = a.run_id AND t.problem_no = a.problem_no AND t.parent_no = a.parent_no AND t.branch = 'take'
    WHERE a.branch = 'rest'
),
message AS MATERIALIZED (
    SELECT run_id, problem_no, node_no, unit_no, label_no, sum(dual) AS dual
    FROM bound_message GROUP BY run_id, problem_no, node_no, unit_no, label_no
),
allowed AS MATERIALIZED (
    SELECT n.run_id, n.problem_no, n.node_no, s.unit_no, s.label_no,
        coalesce(p.dual_scale, 1) * s.cost - coalesce(m.dual, 0) - coalesce(q.dual, 0) AS reduced
    FROM proof AS n
    JOIN problem AS p ON p.run_id = n.run_id AND p.problem_no = n.problem_no
    JOIN state AS s ON s.run_id = n.run_id AND s.problem_no = n.problem_no
    LEFT JOIN forbidden AS f ON f.run_id = n.run_id AND f.problem_no = n.problem_no AND f.node_no = n.node_no
        AND f.unit_no = s.unit_no AND f.label_no = coalesce(s.label_no, -1)
    LEFT JOIN message AS m ON m.run_id = n.run_id AND m.problem_no = n.problem_no AND m.node_no = n.node_no
        AND m.unit_no = s.unit_no AND m.label_no = s.label_no
    LEFT JOIN bound_price AS q ON q.run_id = n.run_id AND q.problem_no = n.problem_no AND q.node_no = n.node_no
        AND q.label_no = s.label_no
    WHERE f.unit_no IS NULL
),
least AS MATERIALIZED (
    -- Units that no state is left for make the node empty: its bound is as high as one likes.
    SELECT n.run_id, n.problem_no, n.node_no, d.unit_no, coalesce(min(a.reduced), 1e300) AS reduced
    FROM proof AS n
    JOIN assignment AS d ON d.run_id = n.run_id AND d.problem_no = n.problem_no
    LEFT JOIN allowed AS a ON a.run_id = n.run_id AND a.problem_no = n.problem_no AND a.node_no = n.node_no
        AND a.unit_no = d.unit_no
    GROUP BY n.run_id, n.problem_no, n.node_no, d.unit_no
),
price AS MATERIALIZED (
    SELECT run_id, problem_no, node_no, sum(dual) AS dual FROM bound_price GROUP BY run_id, problem_no, node_no
),
proved AS MATERIALIZED (
    SELECT n.run_id, n.problem_no, n.node_no, coalesce(sum(l.reduced), 0) + coalesce(max(q.dual), 0) AS value
    FROM proof AS n
    LEFT JOIN least AS l ON l.run_id = n.run_id AND l.problem_no = n.problem_no AND l.node_no = n.node_no
    LEFT JOIN price AS q ON q.run_id = n.run_id AND q.problem_no = n.problem_no AND q.node_no = n.node_no
    GROUP BY n.run_id, n.problem_no, n.node_no
),
leaf AS MATERIALIZED (
    SELECT n.run_id, n.problem_no, n.node_no, n.bound, p.dual_scale,
        v.value + CASE WHEN n.branch = 'take' AND n.proof_no = n.parent_no THEN coalesce(a.reduced - l.reduced, 0)
            ELSE 0 END AS value
    FROM search_node AS n
    JOIN problem AS p ON p.run_id = n.run_id AND p.problem_no = n.problem_no
    JOIN proved AS v ON v.run_id = n.run_id AND v.problem_no = n.problem_no AND v.node_no = n.proof_no
    LEFT JOIN allowed AS a ON a.run_id = n.run_id AND a.problem_no = n.problem_no AND a.node_no = n.proof_no
        AND a.unit_no = n.unit_no AND coalesce(a.label_no, -1) = coalesce(n.label_no, -1)
    LEFT JOIN least AS l ON l.run_id = n.run_id AND l.problem_no = n.problem_no AND l.node_no = n.proof_no
        AND l.unit_no = n.unit_no
    WHERE n.status <> 'branched'
),
pair AS MATERIALIZED (
    SELECT c.run_id, c.problem_no, c.unit_a, c.label_a, c.unit_b, c.label_b,
        coalesce(p.dual_scale, 1)
            * (least(c.saves, coalesce(r.weight, 0)) + least(c.saves, coalesce(i.weight, 0))) AS saves
    FROM compatibility AS c
    JOIN problem AS p ON p.run_id = c.run_id AND p.problem_no = c.problem_no
    LEFT JOIN problem_relation AS r ON r.run_id = c.run_id AND r.problem_no = c.problem_no
        AND r.unit_no = c.unit_a AND r.neighbour_no = c.unit_b
    LEFT JOIN problem_relation AS i ON i.run_id = c.run_id AND i.problem_no = c.problem_no
        AND i.unit_no = c.unit_b AND i.neighbour_no = c.unit_a
),
found AS MATERIALIZED (
    SELECT a.run_id, a.problem_no, 'messages promise less than a pair saves' AS what, count(*) AS times
    FROM pair AS c
    JOIN allowed AS a
        ON a.run_id = c.run_id AND a.problem_no = c.problem_no AND a.unit_no = c.unit_a AND a.label_no = c.label_a
    JOIN allowed AS b ON b.run_id = c.run_id AND b.problem_no = c.problem_no AND b.node_no = a.node_no
        AND b.unit_no = c.unit_b AND b.label_no = c.label_b
    LEFT JOIN bound_message AS y ON y.run_id = c.run_id AND y.problem_no = c.problem_no AND y.node_no = a.node_no
        AND y.unit_no = c.unit_a AND y.label_no = c.label_a AND y.neighbour_no = c.unit_b
    LEFT JOIN bound_message AS z ON z.run_id = c.run_id AND z.problem_no = c.problem_no AND z.node_no = a.node_no
        AND z.unit_no = c.unit_b AND z.label_no = c.label_b AND z.neighbour_no = c.unit_a
    WHERE coalesce(y.dual, 0) + coalesce(z.dual, 0) < c.saves
    GROUP BY a.run_id, a.problem_no
    UNION ALL
    SELECT run_id, problem_no, 'a message is negative', count(*)
    FROM bound_message WHERE dual < 0 GROUP BY run_id, problem_no
    UNION ALL
    SELECT run_id, problem_no, 'a dual is there twice', count(*)
    FROM (
        SELECT run_id, problem_no FROM bound_message
        GROUP BY run_id, problem_no, node_no, unit_no, label_no, neighbour_no HAVING count(*) > 1
        UNION ALL
        SELECT run_id, problem_no FROM bound_price
        GROUP BY run_id, problem_no, node_no, label_no HAVING count(*) > 1
    ) AS twice
    GROUP BY run_id, problem_no
    UNION ALL
    SELECT q.run_id, q.problem_no, 'a label has a positive dual, or one where it may be taken twice', count(*)
    FROM bound_price AS q
    JOIN problem AS p ON p.run_id = q.run_id AND p.problem_no = q.problem_no
    WHERE q.dual > 0 OR (NOT p.injective AND q.dual <> 0)
    GROUP BY q.run_id, q.problem_no
    UNION ALL
    SELECT run_id, problem_no, 'the bound of a node', count(*)
    FROM leaf
    WHERE CASE WHEN dual_scale IS NULL THEN bound > value + 1e-6 * (1 + abs(value))
        ELSE (bound - 1) * dual_scale >= value END
    GROUP BY run_id, problem_no
    UNION ALL
    SELECT n.run_id, n.problem_no, 'the nodes do not cover what they were split from', count(*)
    FROM search_node AS n
    LEFT JOIN search_node AS parent
        ON parent.run_id = n.run_id AND parent.problem_no = n.problem_no AND parent.node_no = n.parent_no
    WHERE (n.status = 'branched' AND 1 <> (
            SELECT count(*) FROM search_node AS rest
            WHERE rest.run_id = n.run_id AND rest.problem_no = n.problem_no AND rest.parent_no = n.node_no
                AND rest.branch = 'rest'
        ))
        OR (n.parent_no IS NOT NULL AND (parent.node_no IS NULL OR parent.status <> 'branched'
            OR n.parent_no >= n.node_no))
        OR NOT (n.proof_no = n.node_no OR n.proof_no = coalesce(n.parent_no, n.node_no))
    GROUP BY n.run_id, n.problem_no
    UNION ALL
    SELECT p.run_id, p.problem_no, 'the bound of the problem', 1
    FROM problem AS p
    LEFT JOIN search_node AS n ON n.run_id = p.run_id AND n.problem_no = p.problem_no
    GROUP BY p.run_id, p.problem_no, p.bound, p.cost, p.status, p.bound_kept
    HAVING ((p.bound_kept OR count(n.node_no) > 0) AND count(CASE WHEN n.branch = 'root' THEN 1 END) <> 1)
        OR p.bound > min(CASE WHEN n.status <> 'branched' THEN n.bound END) + 1e-6 * (1 + abs(p.bound))
        OR p.bound > p.cost + 1e-6 * (1 + abs(p.cost))
        OR (p.status = 'optimal' AND abs(p.bound - p.cost) > 1e-6 * (1 + abs(p.cost)))
)
SELECT run_id, problem_no, what, times FROM found ORDER BY run_id, problem_no, what
