-- A size of a part or feature in each usable inspection that measured it, the oldest first.
-- Takes path and what; gives quantity, run, began_at, serial, value, sigma, nominal, bound (how far it must differ to count as
-- changed, null where odds decide), changed and unit.
SELECT m.what AS quantity, m.run_id AS run, r.began_at, i.serial, m.value, m.sigma, m.nominal,
    CASE WHEN m.what IN ('diameter', 'shift', 'thickness', 'width') THEN greatest(t.value, k.value * m.sigma) END AS bound,
    m.changed, m.unit
FROM presence AS p
JOIN measured_size AS m ON m.run_id = p.run_id AND m.item_no = p.item_no
JOIN inspection AS i ON i.run_id = p.run_id AND i.verdict = 'accepted'
JOIN run AS r ON r.id = p.run_id
LEFT JOIN threshold AS t ON t.run_id = m.run_id AND t.decision = 'presence'
    AND t.name = CASE m.what WHEN 'thickness' THEN 'states.changed_wall_mm' ELSE 'states.changed_mm' END
LEFT JOIN threshold AS k ON k.run_id = m.run_id AND k.decision = 'presence' AND k.name = 'states.changed_sigma'
WHERE p.path = :path AND m.what = :what
ORDER BY m.run_id, m.measure_no
