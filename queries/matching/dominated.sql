-- Candidates that no best labelling needs: having no label costs their unit no more, whatever the others have. With the
-- label, the unit pays for each neighbour that has no candidate to confirm it; without, at most what it could confirm
-- of its neighbours is lost besides.
-- Takes run_id, problem_no, and problem_unit (unit_no, null_cost) as a relation; gives unit_no, label_no.
WITH confirmable AS (
    SELECT unit_a AS unit_no, label_a AS label_no, unit_b AS neighbour_no
    FROM compatibility WHERE run_id = :run_id AND problem_no = :problem_no
    UNION
    SELECT unit_b, label_b, unit_a
    FROM compatibility WHERE run_id = :run_id AND problem_no = :problem_no
),
lost AS (
    SELECT c.unit_no, c.label_no,
        sum(CASE WHEN k.neighbour_no IS NULL THEN own.weight ELSE 0 END) AS unconfirmed,
        sum(CASE WHEN k.neighbour_no IS NULL THEN 0 ELSE theirs.weight END) AS confirming
    FROM candidate AS c
    JOIN problem_relation AS own ON own.run_id = c.run_id AND own.problem_no = c.problem_no AND own.unit_no = c.unit_no
    JOIN problem_relation AS theirs ON theirs.run_id = c.run_id AND theirs.problem_no = c.problem_no
        AND theirs.unit_no = own.neighbour_no AND theirs.neighbour_no = c.unit_no
    LEFT JOIN confirmable AS k ON k.unit_no = c.unit_no AND k.label_no = c.label_no
        AND k.neighbour_no = own.neighbour_no
    WHERE c.run_id = :run_id AND c.problem_no = :problem_no
    GROUP BY c.unit_no, c.label_no
)
SELECT c.unit_no, c.label_no
FROM candidate AS c
JOIN problem_unit AS u ON u.unit_no = c.unit_no
LEFT JOIN lost AS l ON l.unit_no = c.unit_no AND l.label_no = c.label_no
WHERE c.run_id = :run_id AND c.problem_no = :problem_no
    AND c.cost + coalesce(l.unconfirmed, 0) >= u.null_cost + coalesce(l.confirming, 0)
ORDER BY c.unit_no, c.label_no
