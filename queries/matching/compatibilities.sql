-- Append the pairs of candidates that confirm each other: the labels are related as the units are, within the
-- tolerances of the kind, by half of the weight at least. Where a label may be taken twice, pieces of one thing confirm
-- each other if they do not lie apart sideways.
-- Takes run_id, problem_no; appends to compatibility.
INSERT INTO compatibility (run_id, problem_no, unit_a, label_a, unit_b, label_b)
WITH related AS (
    SELECT
        p.run_id, p.problem_no, r.unit_a, a.label_no AS label_a, r.unit_b, b.label_no AS label_b, t.weight,
        CASE
            WHEN a.label_no = b.label_no AND p.injective THEN 0
            WHEN a.label_no = b.label_no
                THEN CASE WHEN r.kind <> 'parallel' OR abs(CAST(r.distance AS DOUBLE PRECISION)) <= t.distance
                    THEN t.weight ELSE 0 END
            WHEN abs(CAST(r.distance AS DOUBLE PRECISION) - CAST(s.distance AS DOUBLE PRECISION))
                    <= t.distance + t.distance_share * abs(CAST(r.distance AS DOUBLE PRECISION))
                -- angles are those of a full turn: 3.1 and -3.1 differ by .08
                AND abs(CAST(r.angle AS DOUBLE PRECISION) - CAST(s.angle AS DOUBLE PRECISION)
                    - 2 * pi() * round((CAST(r.angle AS DOUBLE PRECISION) - CAST(s.angle AS DOUBLE PRECISION))
                        / (2 * pi()))) <= t.angle
                THEN t.weight
            ELSE 0
        END AS confirmed
    FROM problem AS p
    JOIN unit_relation AS r ON r.unit_set_id = p.units_id AND r.unit_a < r.unit_b
    JOIN problem_tolerance AS t ON t.run_id = p.run_id AND t.problem_no = p.problem_no AND t.kind = r.kind
        AND abs(r.distance) <= t.reach
    JOIN candidate AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.unit_no = r.unit_a
    JOIN candidate AS b ON b.run_id = p.run_id AND b.problem_no = p.problem_no AND b.unit_no = r.unit_b
    LEFT JOIN unit_relation AS s ON s.unit_set_id = p.labels_id AND s.kind = r.kind
        AND s.unit_a = a.label_no AND s.unit_b = b.label_no
    WHERE p.run_id = :run_id AND p.problem_no = :problem_no
)
SELECT run_id, problem_no, unit_a, label_a, unit_b, label_b
FROM related
GROUP BY run_id, problem_no, unit_a, label_a, unit_b, label_b
HAVING sum(confirmed) > 0 AND 2 * sum(confirmed) >= sum(weight)
