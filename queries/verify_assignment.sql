-- Verify an assignment and the proof that it is optimal, from its rows alone, apart from the solver.
-- takes: run_id, problem_no
-- gives: one row of
--   cost_stored          what the problem says it costs
--   cost                 sum, over the units, of the candidate that each was given, or of having none
--   bound                sum of all dual values: a lower bound of the cost of any assignment if the next two hold
--   least_reduced_cost   least of candidate cost - dual of the unit - dual of the label, having no label included;
--                        must be >= 0
--   greatest_label_dual  must be <= 0
--   unpriced             decisions that are no candidate, or whose cost is not the candidate's; must be 0
--   undecided            units that have candidates and no decision; must be 0
--   doubly_taken         labels given to more than one unit; must be 0
WITH chosen AS (
    SELECT
        a.unit_no, a.label_no, a.cost AS paid, a.null_cost,
        CASE WHEN a.label_no IS NULL THEN a.null_cost ELSE c.cost END AS cost
    FROM assignment AS a
    LEFT JOIN candidate AS c
        ON c.run_id = a.run_id AND c.problem_no = a.problem_no AND c.unit_no = a.unit_no AND c.label_no = a.label_no
    WHERE a.run_id = :run_id AND a.problem_no = :problem_no
),
dual AS (
    SELECT side, item_no, dual FROM bound_certificate WHERE run_id = :run_id AND problem_no = :problem_no
),
reduced AS (
    SELECT c.cost - coalesce(u.dual, 0) - coalesce(l.dual, 0) AS cost
    FROM candidate AS c
    LEFT JOIN dual AS u ON u.side = 'unit' AND u.item_no = c.unit_no
    LEFT JOIN dual AS l ON l.side = 'label' AND l.item_no = c.label_no
    WHERE c.run_id = :run_id AND c.problem_no = :problem_no
    UNION ALL
    SELECT a.null_cost - coalesce(u.dual, 0)
    FROM chosen AS a
    LEFT JOIN dual AS u ON u.side = 'unit' AND u.item_no = a.unit_no
)
SELECT
    p.cost AS cost_stored,
    (SELECT coalesce(sum(cost), 0) FROM chosen) AS cost,
    (SELECT coalesce(sum(dual), 0) FROM dual) AS bound,
    (SELECT coalesce(min(cost), 0) FROM reduced) AS least_reduced_cost,
    (SELECT coalesce(max(dual), 0) FROM dual WHERE side = 'label') AS greatest_label_dual,
    (SELECT count(*) FROM chosen WHERE cost IS NULL OR abs(paid - cost) > 1e-9) AS unpriced,
    (
        SELECT count(DISTINCT c.unit_no) FROM candidate AS c
        WHERE c.run_id = :run_id AND c.problem_no = :problem_no
            AND NOT EXISTS (SELECT 1 FROM chosen WHERE chosen.unit_no = c.unit_no)
    ) AS undecided,
    (
        SELECT count(*) FROM (SELECT label_no FROM chosen WHERE label_no IS NOT NULL GROUP BY label_no HAVING count(*) > 1) AS d
    ) AS doubly_taken
FROM problem AS p
WHERE p.run_id = :run_id AND p.problem_no = :problem_no;
