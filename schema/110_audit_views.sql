-- Audit: what a run decided and why, as views that a person can query.

CREATE VIEW run_summary AS
SELECT
    r.id AS run_id, r.kind, r.began_at, e.seconds, s.state, p.verdict, e.message, p.evidence_ratio
FROM run AS r
JOIN run_state AS s ON s.run_id = r.id
LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead')
LEFT JOIN pose AS p ON p.run_id = r.id;
COMMENT ON VIEW run_summary IS 'Every run with how it ended, and the verdict where it was an inspection.';
COMMENT ON COLUMN run_summary.run_id IS 'the run';
COMMENT ON COLUMN run_summary.kind IS 'what was run';
COMMENT ON COLUMN run_summary.began_at IS 'when the run began';
COMMENT ON COLUMN run_summary.seconds IS 'how long it took, s; null while it runs, and where it was killed';
COMMENT ON COLUMN run_summary.state IS 'running, finished, failed or killed';
COMMENT ON COLUMN run_summary.verdict IS 'verdict of an inspection: accepted, ambiguous or refused; null of other runs';
COMMENT ON COLUMN run_summary.message IS 'the error or the reason';
COMMENT ON COLUMN run_summary.evidence_ratio IS 'evidence found in the images over what a right pose would find; null where it was no inspection';

CREATE VIEW pose_world AS
WITH axis AS (  -- of the world, in the rig's frame: rows of the rotation, for translation (block 0) and rotation (3)
    SELECT run_id, 0 AS axis_no, 0 AS block, m00 AS x, m01 AS y, m02 AS z FROM pose
    UNION ALL SELECT run_id, 1, 0, m10, m11, m12 FROM pose
    UNION ALL SELECT run_id, 2, 0, m20, m21, m22 FROM pose
    UNION ALL SELECT run_id, 3, 3, m00, m01, m02 FROM pose
    UNION ALL SELECT run_id, 4, 3, m10, m11, m12 FROM pose
    UNION ALL SELECT run_id, 5, 3, m20, m21, m22 FROM pose
),
turned AS (
    SELECT p.run_id, array_agg(
        a.x * (p.covariance[6 * a.block + b.block + 1] * b.x + p.covariance[6 * a.block + b.block + 2] * b.y
            + p.covariance[6 * a.block + b.block + 3] * b.z)
        + a.y * (p.covariance[6 * a.block + b.block + 7] * b.x + p.covariance[6 * a.block + b.block + 8] * b.y
            + p.covariance[6 * a.block + b.block + 9] * b.z)
        + a.z * (p.covariance[6 * a.block + b.block + 13] * b.x + p.covariance[6 * a.block + b.block + 14] * b.y
            + p.covariance[6 * a.block + b.block + 15] * b.z)
        ORDER BY a.axis_no, b.axis_no
    ) AS covariance
    FROM pose AS p
    JOIN axis AS a ON a.run_id = p.run_id
    JOIN axis AS b ON b.run_id = p.run_id
    GROUP BY p.run_id
)
SELECT
    p.run_id, p.verdict, p.m03 AS x, p.m13 AS y, p.m23 AS z,
    sqrt(greatest(t.covariance[1], 0)) AS sigma_x, sqrt(greatest(t.covariance[8], 0)) AS sigma_y,
    sqrt(greatest(t.covariance[15], 0)) AS sigma_z, sqrt(greatest(t.covariance[22], 0)) AS sigma_rx,
    sqrt(greatest(t.covariance[29], 0)) AS sigma_ry, sqrt(greatest(t.covariance[36], 0)) AS sigma_rz,
    t.covariance
FROM pose AS p
JOIN turned AS t ON t.run_id = p.run_id;
COMMENT ON VIEW pose_world IS 'Where the rig was in the world, and how sure that is along and about the world''s axes; pose has the same in the rig''s frame.';
COMMENT ON COLUMN pose_world.run_id IS 'the run';
COMMENT ON COLUMN pose_world.verdict IS 'accepted, ambiguous or refused';
COMMENT ON COLUMN pose_world.x IS 'x of the rig''s origin in the world, mm';
COMMENT ON COLUMN pose_world.y IS 'y of the rig''s origin in the world, mm';
COMMENT ON COLUMN pose_world.z IS 'z of the rig''s origin in the world, mm';
COMMENT ON COLUMN pose_world.sigma_x IS 'standard deviation of the rig''s origin along the world''s x, mm';
COMMENT ON COLUMN pose_world.sigma_y IS 'standard deviation of the rig''s origin along the world''s y, mm';
COMMENT ON COLUMN pose_world.sigma_z IS 'standard deviation of the rig''s origin along the world''s z, mm';
COMMENT ON COLUMN pose_world.sigma_rx IS 'standard deviation of the rotation about the world''s x direction, rad';
COMMENT ON COLUMN pose_world.sigma_ry IS 'standard deviation of the rotation about the world''s y direction, rad';
COMMENT ON COLUMN pose_world.sigma_rz IS 'standard deviation of the rotation about the world''s z direction, rad';
COMMENT ON COLUMN pose_world.covariance IS '6x6 row-major: shift of the rig''s origin in mm, then small rotation about it in rad, both in the world''s axes: each 3x3 block of pose.covariance is R block R^T, R the rotation of world_from_rig';

CREATE VIEW matched_arc AS
SELECT
    c.run_id, v.camera, o.name || n.path AS path, a.kind AS view_kind, a.arc_no, a.surface_no, a.occurrence_id,
    c.view_arc_no, c.image_arc_no, c.residual, c.angle, c.overlap
FROM correspondence AS c
JOIN view_arc AS a ON a.run_id = c.run_id AND a.view_no = c.view_no AND a.view_arc_no = c.view_arc_no
JOIN view AS v ON v.run_id = c.run_id AND v.view_no = c.view_no
JOIN placed_object AS o ON o.object_no = a.occurrence_id >> 28  -- as placed_node, whose name comes after this view's
JOIN object_node AS n ON n.object_id = o.object_id AND n.node_no = a.occurrence_id & 268435455
WHERE c.hypothesis_no = 0 AND c.accepted;
COMMENT ON VIEW matched_arc IS 'Pairs of model arc and image arc that the best hypothesis of each run took, with residual (px).';
COMMENT ON COLUMN matched_arc.run_id IS 'the run';
COMMENT ON COLUMN matched_arc.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN matched_arc.path IS 'path of the placed part';
COMMENT ON COLUMN matched_arc.view_kind IS 'sharp, smooth or silhouette';
COMMENT ON COLUMN matched_arc.arc_no IS 'the arc in the shape of the part; null for a silhouette';
COMMENT ON COLUMN matched_arc.surface_no IS 'the surface that a silhouette is of; null for an arc';
COMMENT ON COLUMN matched_arc.occurrence_id IS 'the placed part';
COMMENT ON COLUMN matched_arc.view_arc_no IS 'the model arc in the view';
COMMENT ON COLUMN matched_arc.image_arc_no IS 'the image arc in the extraction';
COMMENT ON COLUMN matched_arc.residual IS 'rms distance of the image arc from the projected model arc, px';
COMMENT ON COLUMN matched_arc.angle IS 'mean angle between them, rad';
COMMENT ON COLUMN matched_arc.overlap IS 'share of the image arc that lies beside the model arc, 0 to 1';

CREATE VIEW rejected_arc AS
WITH best AS (
    SELECT
        c.run_id, v.camera, c.image_arc_no, c.reason, c.residual, c.view_arc_no,
        max(CASE WHEN c.accepted THEN 1 ELSE 0 END) OVER (PARTITION BY c.run_id, v.camera, c.image_arc_no) AS taken,
        row_number() OVER (PARTITION BY c.run_id, v.camera, c.image_arc_no ORDER BY c.residual, c.view_arc_no) AS place
    FROM correspondence AS c
    JOIN view AS v ON v.run_id = c.run_id AND v.view_no = c.view_no
    WHERE c.hypothesis_no = 0
)
SELECT
    i.run_id, i.camera, a.image_arc_no, a.kind, a.length, a.contrast,
    coalesce(best.reason, 'no_candidate') AS reason, best.residual, best.view_arc_no
FROM inspection_image AS i
JOIN image_arc AS a ON a.extraction_id = i.extraction_id
LEFT JOIN best ON best.run_id = i.run_id AND best.camera = i.camera AND best.image_arc_no = a.image_arc_no AND best.place = 1
WHERE coalesce(best.taken, 0) = 0;
COMMENT ON VIEW rejected_arc IS 'Image arcs that the best hypothesis of a run left without a model arc, with the nearest candidate and why it was not taken; no_candidate: no model arc was near.';
COMMENT ON COLUMN rejected_arc.run_id IS 'the run';
COMMENT ON COLUMN rejected_arc.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN rejected_arc.image_arc_no IS 'the image arc in the extraction';
COMMENT ON COLUMN rejected_arc.kind IS 'line, circular, elliptic or free';
COMMENT ON COLUMN rejected_arc.length IS 'its length, px';
COMMENT ON COLUMN rejected_arc.contrast IS 'its contrast, grey levels';
COMMENT ON COLUMN rejected_arc.reason IS 'why the nearest candidate was not taken, or no_candidate';
COMMENT ON COLUMN rejected_arc.residual IS 'rms distance from the nearest candidate, px; null where there is none';
COMMENT ON COLUMN rejected_arc.view_arc_no IS 'the nearest candidate in the view';

CREATE VIEW unmatched_in_stereo AS
SELECT p.run_id, s.extraction_id, u.ref_no AS image_arc_no, a.reason
FROM problem AS p
JOIN unit_set AS s ON s.id = p.units_id
JOIN unit AS u ON u.unit_set_id = s.id AND u.kind = 'arc'
JOIN assignment AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.unit_no = u.unit_no
WHERE p.kind = 'stereo' AND a.label_no IS NULL
UNION ALL
SELECT
    p.run_id, s.extraction_id, u.ref_no,
    CASE
        WHEN EXISTS (
            SELECT 1 FROM candidate AS c
            WHERE c.run_id = p.run_id AND c.problem_no = p.problem_no AND c.label_no = u.unit_no
        ) THEN 'not_taken' ELSE 'no_candidate'
    END
FROM problem AS p
JOIN unit_set AS s ON s.id = p.labels_id
JOIN unit AS u ON u.unit_set_id = s.id AND u.kind = 'arc'
WHERE p.kind = 'stereo' AND NOT EXISTS (
    SELECT 1 FROM assignment AS a
    WHERE a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.label_no = u.unit_no
);
COMMENT ON VIEW unmatched_in_stereo IS 'Arcs of both images of a pair that stereo left without a partner: they weigh less in localisation.';
COMMENT ON COLUMN unmatched_in_stereo.run_id IS 'the run';
COMMENT ON COLUMN unmatched_in_stereo.extraction_id IS 'extraction of the image';
COMMENT ON COLUMN unmatched_in_stereo.image_arc_no IS 'the image arc in the extraction';
COMMENT ON COLUMN unmatched_in_stereo.reason IS 'of an arc of the left image as in assignment; of the right one no_candidate, or not_taken: none of the left arcs that it could be took it';

CREATE VIEW attribute_log AS
WITH stated AS (
    SELECT 'world' AS level, world_id AS owner_id, CAST(NULL AS INTEGER) AS surface_no, CAST(NULL AS INTEGER) AS arc_no, name, value_number, value_text, value_boolean, unit, source, run_id
    FROM world_attribute
    UNION ALL
    SELECT 'object', object_id, NULL, NULL, name, value_number, value_text, value_boolean, unit, source, run_id
    FROM object_attribute
    UNION ALL
    SELECT 'part', part_id, NULL, NULL, name, value_number, value_text, value_boolean, unit, source, run_id
    FROM part_attribute
    UNION ALL
    SELECT 'surface', shape_id, surface_no, NULL, name, value_number, value_text, value_boolean, unit, source, run_id
    FROM surface_attribute
    UNION ALL
    SELECT 'arc', shape_id, NULL, arc_no, name, value_number, value_text, value_boolean, unit, source, run_id
    FROM arc_attribute
)
SELECT a.level, a.owner_id, a.surface_no, a.arc_no, a.name,
    coalesce(a.value_text, CAST(a.value_number AS TEXT), CAST(a.value_boolean AS TEXT)) AS value, a.unit, a.source, a.run_id,
    r.began_at AS stated_at, r.parameters ->> 'user' AS stated_by
FROM stated AS a
JOIN run AS r ON r.id = a.run_id;
COMMENT ON VIEW attribute_log IS 'Every value that an attribute ever had, of every level: what, when and by whom.';
COMMENT ON COLUMN attribute_log.level IS 'world, object, part, surface or arc';
COMMENT ON COLUMN attribute_log.owner_id IS 'the world, object or part; of a surface or arc its shape';
COMMENT ON COLUMN attribute_log.surface_no IS 'the surface in the shape; null of other levels';
COMMENT ON COLUMN attribute_log.arc_no IS 'the arc in the shape; null of other levels';
COMMENT ON COLUMN attribute_log.name IS 'name of the attribute';
COMMENT ON COLUMN attribute_log.value IS 'the value as text';
COMMENT ON COLUMN attribute_log.unit IS 'its unit';
COMMENT ON COLUMN attribute_log.source IS 'where the value comes from: file, derived, user';
COMMENT ON COLUMN attribute_log.run_id IS 'the run that stated it';
COMMENT ON COLUMN attribute_log.stated_at IS 'when that run began';
COMMENT ON COLUMN attribute_log.stated_by IS 'name of the user who ran relmodel set; null of other runs';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('run_summary', 'run', 'view'),
    ('pose_world', 'localisation', 'view'),
    ('matched_arc', 'localisation', 'view'),
    ('rejected_arc', 'localisation', 'view'),
    ('unmatched_in_stereo', 'matching', 'view'),
    ('attribute_log', 'run', 'view');
