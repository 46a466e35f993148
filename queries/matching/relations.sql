-- Append the relations of a problem's units that have candidates, each with the weight of all its kinds.
-- Takes run_id, problem_no; appends to problem_relation.
INSERT INTO problem_relation (run_id, problem_no, unit_no, neighbour_no, weight)
SELECT p.run_id, p.problem_no, r.unit_a, r.unit_b, sum(t.weight)
FROM problem AS p
JOIN unit_relation AS r ON r.unit_set_id = p.units_id
JOIN problem_tolerance AS t ON t.run_id = p.run_id AND t.problem_no = p.problem_no AND t.kind = r.kind
        AND abs(r.distance) <= t.reach
WHERE p.run_id = :run_id AND p.problem_no = :problem_no
    AND r.unit_a IN (SELECT unit_no FROM candidate WHERE run_id = :run_id AND problem_no = :problem_no)
    AND r.unit_b IN (SELECT unit_no FROM candidate WHERE run_id = :run_id AND problem_no = :problem_no)
GROUP BY p.run_id, p.problem_no, r.unit_a, r.unit_b
HAVING sum(t.weight) > 0
