-- Arcs, regions, view arcs, hypotheses, parts and features that have not exactly one final decision, with its reason,
-- in each step that decides of them.
-- Takes nothing; gives run_id, step, subject and how many decisions it has.
WITH decided AS (
    SELECT p.run_id, concat(p.kind, ' ', p.problem_no) AS step, concat(u.kind, ' ', u.ref_no) AS subject,
        count(a.unit_no) AS decisions, count(nullif(a.reason, '')) AS reasons
    FROM problem AS p
    JOIN unit AS u ON u.unit_set_id = p.units_id
    LEFT JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.unit_no = u.unit_no
    GROUP BY p.run_id, p.kind, p.problem_no, u.kind, u.ref_no, u.unit_no
    UNION ALL
    -- What is assigned has its pair, and what has its pair taken is assigned so.
    SELECT c.run_id, concat('correspondence ', p.problem_no), concat('arc ', c.image_arc_no), count(*), count(a.unit_no)
    FROM correspondence AS c
    JOIN unit_set AS s ON s.run_id = c.run_id AND s.view_no = c.view_no
    JOIN problem AS p ON p.run_id = c.run_id AND p.labels_id = s.id
    JOIN unit AS l ON l.unit_set_id = s.id AND l.kind = 'view_arc' AND l.ref_no = c.view_arc_no
    JOIN unit AS u ON u.unit_set_id = p.units_id AND u.kind = 'arc' AND u.ref_no = c.image_arc_no
    LEFT JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.unit_no = u.unit_no
        AND a.label_no = l.unit_no
    WHERE c.accepted AND c.hypothesis_no = 0
    GROUP BY c.run_id, p.problem_no, c.image_arc_no
    UNION ALL
    SELECT v.run_id, 'view', concat('view arc ', v.view_arc_no, ' of view ', v.view_no), count(u.unit_no), count(u.unit_no)
    FROM view_arc AS v
    JOIN unit_set AS s ON s.run_id = v.run_id AND s.view_no = v.view_no
    LEFT JOIN unit AS u ON u.unit_set_id = s.id AND u.kind = 'view_arc' AND u.ref_no = v.view_arc_no
    GROUP BY v.run_id, v.view_no, v.view_arc_no
    UNION ALL
    SELECT h.run_id, 'verdict', concat('hypothesis ', h.hypothesis_no), count(y.rule), count(y.rule)
    FROM hypothesis AS h
    LEFT JOIN why_hypothesis AS y ON y.run_id = h.run_id AND y.hypothesis_no = h.hypothesis_no
    GROUP BY h.run_id, h.hypothesis_no
    UNION ALL
    SELECT v.run_id, 'presence', v.path, count(i.item_no), count(nullif(i.reason, ''))
    FROM part_in_view AS v
    LEFT JOIN presence AS i ON i.run_id = v.run_id AND i.level = v.level AND i.occurrence_id = v.occurrence_id
        AND coalesce(i.feature_no, -1) = coalesce(v.feature_no, -1)
    WHERE EXISTS (SELECT 1 FROM presence AS o WHERE o.run_id = v.run_id AND o.occurrence_id = v.occurrence_id)
    GROUP BY v.run_id, v.in_view_no, v.path
)
SELECT run_id, step, subject, decisions
FROM decided
WHERE decisions <> 1 OR reasons <> 1
ORDER BY run_id, step, subject
