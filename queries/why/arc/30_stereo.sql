-- What stereo decided of it: the arc of the other picture, or why none; as one that is matched, or matched to.
-- Takes run, camera and arc; gives sentence.
WITH own AS (
    SELECT u.unit_set_id, u.unit_no
    FROM inspection_image AS i
    JOIN unit_set AS s ON s.extraction_id = i.extraction_id
    JOIN unit AS u ON u.unit_set_id = s.id AND u.kind = 'arc' AND u.ref_no = :arc
    WHERE i.run_id = :run AND i.camera = :camera
),
decided AS (
    SELECT a.reason, a.cost, a.null_cost, l.ref_no, count(c.label_no) AS candidates
    FROM own AS o
    JOIN problem AS p ON p.run_id = :run AND p.kind = 'stereo' AND p.units_id = o.unit_set_id
    JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.unit_no = o.unit_no
    LEFT JOIN unit AS l ON l.unit_set_id = p.labels_id AND l.unit_no = a.label_no
    LEFT JOIN candidate AS c ON c.run_id = a.run_id AND c.problem_no = a.problem_no AND c.unit_no = a.unit_no
    GROUP BY a.reason, a.cost, a.null_cost, l.ref_no
    UNION ALL
    SELECT a.reason, a.cost, a.null_cost, w.ref_no, -1
    FROM own AS o
    JOIN problem AS p ON p.run_id = :run AND p.kind = 'stereo' AND p.labels_id = o.unit_set_id
    JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.label_no = o.unit_no
    JOIN unit AS w ON w.unit_set_id = p.units_id AND w.unit_no = a.unit_no
)
SELECT CASE
    WHEN ref_no IS NOT NULL THEN concat('stereo: the same edge as arc ', ref_no, ' of the other picture, at a cost of ',
        CAST(cost AS NUMERIC(18, 2)), ' (', CAST(null_cost AS NUMERIC(18, 2)), ' to leave it unmatched)',
        CASE WHEN candidates > 1 THEN concat('; one of ', candidates, ' candidates') ELSE '' END)
    ELSE concat('stereo: no arc of the other picture is the same edge (', reason, '); ', candidates, ' candidates')
    END AS sentence
FROM decided
ORDER BY ref_no
