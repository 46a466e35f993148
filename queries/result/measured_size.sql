-- Sizes of what is in view, measured in the pictures, those first that differ.
-- Takes run_id; gives path (a name that stays from run to run), what was measured, the model's value, the measured one with
-- its standard deviation, unit, how far it must differ to count as changed (null: odds decide), whether it does, and
-- the state of the part or feature, in our words and QIF's.
SELECT p.path, m.what, m.nominal, m.value, m.sigma, m.unit,
    CASE WHEN m.what IN ('diameter', 'shift', 'thickness', 'width') THEN greatest(t.value, k.value * m.sigma) END
        AS least_difference,
    m.changed, p.state, p.qif, m.measure_no
FROM measured_size AS m
JOIN presence AS p ON p.run_id = m.run_id AND p.item_no = m.item_no
LEFT JOIN threshold AS t ON t.run_id = m.run_id AND t.decision = 'presence'
    AND t.name = CASE m.what WHEN 'thickness' THEN 'states.changed_wall_mm' ELSE 'states.changed_mm' END
LEFT JOIN threshold AS k ON k.run_id = m.run_id AND k.decision = 'presence'
    AND k.name = CASE m.what WHEN 'diameter' THEN 'states.changed_diameter_sigma' ELSE 'states.changed_sigma' END
WHERE m.run_id = :run_id AND m.what <> 'distance'
ORDER BY m.changed DESC, p.path, m.measure_no
