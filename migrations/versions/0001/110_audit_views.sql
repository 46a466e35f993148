-- Audit: what a run decided and why, as views that a person can query.

CREATE VIEW run_summary AS
SELECT
    r.id AS run_id, r.kind, r.began_at, e.seconds,
    coalesce(e.status, 'under way') AS status, e.message,
    p.verdict, p.support
FROM run AS r
LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead')
LEFT JOIN pose AS p ON p.run_id = r.id;
COMMENT ON VIEW run_summary IS 'Every run with how it ended, and the verdict where it was an inspection.';

CREATE VIEW matched_arc AS
SELECT
    c.run_id, v.camera, o.path, a.kind AS view_kind, a.element_no, a.occurrence_id,
    c.view_arc_no, c.arc_no AS image_arc_no, c.residual, c.angle, c.overlap
FROM correspondence AS c
JOIN view_arc AS a ON a.run_id = c.run_id AND a.view_no = c.view_no AND a.view_arc_no = c.view_arc_no
JOIN view AS v ON v.run_id = c.run_id AND v.view_no = c.view_no
JOIN occurrence AS o ON o.id = a.occurrence_id
WHERE c.hypothesis_no = 0 AND c.accepted;
COMMENT ON VIEW matched_arc IS 'Pairs of model arc and image arc that the best hypothesis of each run took, with residual (px).';

CREATE VIEW rejected_arc AS
WITH best AS (
    SELECT
        c.run_id, v.camera, c.arc_no, c.reason, c.residual, c.view_arc_no,
        max(CASE WHEN c.accepted THEN 1 ELSE 0 END) OVER (PARTITION BY c.run_id, v.camera, c.arc_no) AS taken,
        row_number() OVER (PARTITION BY c.run_id, v.camera, c.arc_no ORDER BY c.residual, c.view_arc_no) AS place
    FROM correspondence AS c
    JOIN view AS v ON v.run_id = c.run_id AND v.view_no = c.view_no
    WHERE c.hypothesis_no = 0
)
SELECT
    i.run_id, i.camera, a.arc_no, a.kind, a.length, a.contrast,
    coalesce(best.reason, 'no_candidate') AS reason, best.residual, best.view_arc_no
FROM inspection_image AS i
JOIN image_arc AS a ON a.extraction_id = i.extraction_id
LEFT JOIN best ON best.run_id = i.run_id AND best.camera = i.camera AND best.arc_no = a.arc_no AND best.place = 1
WHERE coalesce(best.taken, 0) = 0;
COMMENT ON VIEW rejected_arc IS 'Image arcs that the best hypothesis of a run left without a model arc, with the nearest candidate and why it was not taken; no_candidate: no model arc was near.';
