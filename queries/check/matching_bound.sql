-- Bounds of matching problems that do not follow from the trees of their searches.
-- Takes nothing; gives run_id, problem_no, what, times.
-- The nodes of a search split the labellings: a node that was split is covered by its children, and no labelling costs
-- less than the least bound of the nodes that were not split.
WITH found AS (
    SELECT n.run_id, n.problem_no, 'the nodes do not cover what they were split from' AS what, count(*) AS times
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
    GROUP BY n.run_id, n.problem_no
    UNION ALL
    SELECT p.run_id, p.problem_no, 'the bound of the problem', 1
    FROM problem AS p
    LEFT JOIN search_node AS n ON n.run_id = p.run_id AND n.problem_no = p.problem_no
    GROUP BY p.run_id, p.problem_no, p.bound, p.cost, p.status
    HAVING (count(n.node_no) > 0 AND count(CASE WHEN n.branch = 'root' THEN 1 END) <> 1)
        OR p.bound > min(CASE WHEN n.status <> 'branched' THEN n.bound END) + 1e-6 * (1 + abs(p.bound))
        OR p.bound > p.cost + 1e-6 * (1 + abs(p.cost))
        OR (p.status = 'optimal' AND abs(p.bound - p.cost) > 1e-6 * (1 + abs(p.cost)))
)
SELECT run_id, problem_no, what, times FROM found ORDER BY run_id, problem_no, what
