-- Relations of units that are not there, that are there twice, that lack their inverse, or whose values no measurement
-- gives.
-- Takes nothing; gives unit_set_id, kind, unit_a, unit_b and how many such rows.
SELECT r.unit_set_id, r.kind, r.unit_a, r.unit_b, count(*) AS relations
FROM unit_relation AS r
LEFT JOIN unit AS a ON a.unit_set_id = r.unit_set_id AND a.unit_no = r.unit_a
LEFT JOIN unit AS b ON b.unit_set_id = r.unit_set_id AND b.unit_no = r.unit_b
LEFT JOIN unit_relation AS i
    ON i.unit_set_id = r.unit_set_id AND i.kind = r.kind AND i.unit_a = r.unit_b AND i.unit_b = r.unit_a
GROUP BY r.unit_set_id, r.kind, r.unit_a, r.unit_b
HAVING count(*) > 1 OR count(a.unit_no) < count(*) OR count(b.unit_no) < count(*)
    OR r.unit_a = r.unit_b
    OR (r.kind <> 'surrounds' AND count(i.kind) = 0)
    OR min(r.distance_sigma) < 0 OR min(r.angle_sigma) < 0 OR max(abs(r.angle)) > 3.141593
ORDER BY r.unit_set_id, r.kind, r.unit_a, r.unit_b
