-- Relations of units that are not there, or that are there twice.
-- Takes nothing; gives unit_set_id, kind, unit_a, unit_b and how many such rows.
SELECT r.unit_set_id, r.kind, r.unit_a, r.unit_b, count(*) AS relations
FROM unit_relation AS r
LEFT JOIN unit AS a ON a.unit_set_id = r.unit_set_id AND a.unit_no = r.unit_a
LEFT JOIN unit AS b ON b.unit_set_id = r.unit_set_id AND b.unit_no = r.unit_b
GROUP BY r.unit_set_id, r.kind, r.unit_a, r.unit_b
HAVING count(*) > 1 OR count(a.unit_no) < count(*) OR count(b.unit_no) < count(*)
ORDER BY r.unit_set_id, r.kind, r.unit_a, r.unit_b
