-- Matching problems whose relations, compatibilities or tolerances are not those that their parameters, their
-- candidates and the relations of their units give.
-- Takes nothing; gives run_id, problem_no, what does not follow, and how many rows say so.
-- Problems whose units were pruned with their pictures say nothing.
WITH given AS (
    SELECT p.run_id, p.problem_no, p.nat_cost, p.relation_weight, p.injective, p.kind, p.parameters
    FROM problem AS p
    WHERE EXISTS (SELECT 1 FROM unit AS u WHERE u.unit_set_id = p.units_id)
        AND EXISTS (SELECT 1 FROM unit AS u WHERE u.unit_set_id = p.labels_id)
),
stated AS (
    SELECT g.run_id, g.problem_no, t.kind, t.distance, t.distance_share, t.angle, t.reach, t.nats,
        (g.parameters -> 'tolerances') -> t.kind AS said
    FROM given AS g
    JOIN problem_tolerance AS t ON t.run_id = g.run_id AND t.problem_no = g.problem_no
),
priced AS (
    SELECT run_id, problem_no, nat_cost, relation_weight,
        CASE WHEN kind = 'localisation' THEN CAST(parameters ->> 'scale' AS DOUBLE PRECISION)
            ELSE CAST((parameters -> 'assignment') ->> 'scale' AS DOUBLE PRECISION)
                * CAST((parameters -> 'assignment') ->> (CASE WHEN (parameters ->> 'method') = 'pong' THEN 'relation_share'
                    ELSE 'bare_relation_share' END) AS DOUBLE PRECISION)
        END AS due_cost,
        CASE WHEN kind = 'localisation' THEN CAST(parameters ->> 'scale' AS DOUBLE PRECISION)
            * CAST(parameters ->> 'relation_price' AS DOUBLE PRECISION) END AS due_weight
    FROM given
),
found AS (
    SELECT g.run_id, g.problem_no, 'a relation is not what its candidates and tolerances give' AS what, count(*) AS times
    FROM (
        SELECT coalesce(r.run_id, d.run_id) AS run_id, coalesce(r.problem_no, d.problem_no) AS problem_no
        FROM problem_relation AS r
        FULL JOIN due_relation AS d ON d.run_id = r.run_id AND d.problem_no = r.problem_no AND d.unit_no = r.unit_no
            AND d.neighbour_no = r.neighbour_no
        WHERE r.weight IS NULL OR d.weight IS NULL OR r.weight <> d.weight
    ) AS off
    JOIN given AS g ON g.run_id = off.run_id AND g.problem_no = off.problem_no
    GROUP BY g.run_id, g.problem_no
    UNION ALL
    SELECT g.run_id, g.problem_no, 'a compatibility is not what the relations give', count(*)
    FROM (
        SELECT coalesce(c.run_id, d.run_id) AS run_id, coalesce(c.problem_no, d.problem_no) AS problem_no
        FROM compatibility AS c
        FULL JOIN due_compatibility AS d ON d.run_id = c.run_id AND d.problem_no = c.problem_no AND d.unit_a = c.unit_a
            AND d.label_a = c.label_a AND d.unit_b = c.unit_b AND d.label_b = c.label_b
        WHERE c.saves IS NULL OR d.saves IS NULL OR c.saves <> d.saves
    ) AS off
    JOIN given AS g ON g.run_id = off.run_id AND g.problem_no = off.problem_no
    GROUP BY g.run_id, g.problem_no
    UNION ALL
    SELECT run_id, problem_no, 'a tolerance is not what the parameters say', count(*)
    FROM stated
    WHERE said IS NULL OR CAST(said ->> 'distance' AS DOUBLE PRECISION) <> distance
        OR CAST(said ->> 'distance_share' AS DOUBLE PRECISION) <> distance_share
        OR CAST(said ->> 'angle' AS DOUBLE PRECISION) <> angle OR CAST(said ->> 'reach' AS DOUBLE PRECISION) <> reach
        OR CAST(said ->> 'nats' AS DOUBLE PRECISION) <> nats
    GROUP BY run_id, problem_no
    UNION ALL
    SELECT run_id, problem_no, 'the weight of relations is not what the parameters say', 1
    FROM priced
    WHERE due_cost IS NULL OR abs(nat_cost - due_cost) > 1e-9 * due_cost
        OR (due_weight IS NULL) <> (relation_weight IS NULL) OR abs(relation_weight - due_weight) > 0.5
)
SELECT run_id, problem_no, what, times FROM found ORDER BY run_id, problem_no, what
