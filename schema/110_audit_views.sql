-- Audit: what a run decided and why, as views that a person can query.

CREATE VIEW found_variant (  -- localisation: Which variant of an inspected object the pictures show, where several were weighed.
    run_id,  -- the run
    object_no,  -- the object of the run's world
    name,  -- name of the object
    variant,  -- the variant shown, or those that the pictures do not tell apart (less than 3 nats, 20 to 1), joined by or
    placed_variant,  -- the variant that the world has there
    another,  -- whether the one shown is surely another than that
    words,  -- which one the pictures show, and not
    evidence  -- what says so, one sentence
) AS
WITH ranked AS (
    SELECT e.run_id, e.object_no, e.rank_no, e.placed, e.against, e.decided, v.name,
        array_to_string(e.distinguished_by[1:5], ', ') AS distinguished_by,
        CASE v.variant WHEN '' THEN '(unnamed)' ELSE v.variant END AS variant,
        max(e.log_odds) OVER (PARTITION BY e.run_id, e.object_no) - e.log_odds AS nats_less
    FROM variant_evidence AS e
    JOIN object_variant AS v ON v.id = e.object_variant_id
),
shown AS (  -- 3 nats, 20 to 1, tell one variant from another
    SELECT r.run_id, r.object_no, max(r.name) AS name,
        string_agg(CASE WHEN r.nats_less < 3 THEN r.variant END, ' or ' ORDER BY r.rank_no) AS variant,
        count(CASE WHEN r.nats_less < 3 THEN 1 END) AS alike, min(r.rank_no) AS best_no,
        max(CASE WHEN r.placed THEN r.rank_no END) AS placed_no,
        max(CASE WHEN r.placed THEN r.nats_less END) AS placed_less
    FROM ranked AS r
    GROUP BY r.run_id, r.object_no
    HAVING count(*) > 1
)
SELECT s.run_id, s.object_no, s.name, s.variant, p.variant AS placed_variant, s.placed_less >= 3 AS another,
    concat('the pictures show variant ', s.variant, ' of ', s.name, CASE
        WHEN s.placed_less >= 3 THEN concat(', not ', p.variant)
        WHEN s.alike > 1 THEN ', which they do not tell apart'
        WHEN w.revision = 0 THEN ''
        ELSE ', as the world says'
    END) AS words,
    concat(CASE
        WHEN s.placed_less >= 3 THEN concat('variant ', b.variant, ' explains the pictures better than ', p.variant,
            ', which the world has there, by ', CAST(s.placed_less AS NUMERIC(18, 0)), ' nats of evidence: ',
            b.against, ' of ', b.decided, ' parts and features differ from ', b.variant, ', ', p.against, ' of ',
            p.decided, ' from ', p.variant)
        ELSE concat('variant ', b.variant, ' explains the pictures better than ', o.variant, ' by ',
            CAST(o.nats_less AS NUMERIC(18, 0)), ' nats of evidence')
    END, CASE WHEN s.placed_less >= 3 THEN ' (unlike ' || p.variant || ': ' || p.distinguished_by || ')'
        ELSE ' (unlike ' || o.variant || ': ' || o.distinguished_by || ')' END) AS evidence
FROM shown AS s
LEFT JOIN inspection AS i ON i.run_id = s.run_id
LEFT JOIN world AS w ON w.id = i.world_id
JOIN ranked AS p ON p.run_id = s.run_id AND p.rank_no = s.placed_no
JOIN ranked AS b ON b.run_id = s.run_id AND b.rank_no = s.best_no
JOIN ranked AS o ON o.run_id = s.run_id AND o.rank_no = s.best_no + 1;

CREATE VIEW inspection_outcome (  -- localisation: Whether an inspection's pose may be used, and how the part is: what every title, list, file and exit status reads.
    run_id,  -- the run
    verdict,  -- accepted, ambiguous or refused: of the pose
    pose_verdict,  -- usable, not unique or not found: the same, as a person asks
    part_verdict,  -- as modelled, deviates, another variant, or not enough seen: the pose is not usable, less than two thirds of what is in
        -- view is confirmed, or something is not confirmed
    mood,  -- good, warn or bad: what colour that has; good only where all that is in view is checked
    findings,  -- things that are surely not as modelled, as finding has them; null where nothing was looked at, as where the pose is refused
    checked,  -- parts and features in view that are confirmed, changed or contradicted; null likewise
    in_view,  -- parts and features in view; null likewise
    changed,  -- parts and features that are there in another size or place; null likewise
    contradicted,  -- parts and features in whose place something else is; null likewise
    not_confirmed,  -- parts and features that should be seen and are not; null likewise
    undecidable,  -- parts and features of which the pictures do not tell; null likewise
    variant,  -- that the pictures show another variant than the world has; null where they do not, or none was weighed
    outcome  -- all of it in words
) AS
WITH counted AS (
    SELECT run_id, count(*) AS in_view, count(CASE state WHEN 'confirmed' THEN 1 END) AS confirmed,
        count(CASE state WHEN 'changed' THEN 1 END) AS changed,
        count(CASE state WHEN 'contradicted' THEN 1 END) AS contradicted,
        count(CASE state WHEN 'not_confirmed' THEN 1 END) AS not_confirmed,
        count(CASE state WHEN 'undecidable' THEN 1 END) AS undecidable
    FROM presence
    WHERE level <> 'surface'
    GROUP BY run_id
),
other AS (
    SELECT run_id, string_agg(words, '; ' ORDER BY object_no) AS variant
    FROM found_variant
    WHERE another
    GROUP BY run_id
),
found AS (
    SELECT f.run_id, count(*) AS findings, count(d.run_id) AS accepted,
        string_agg(DISTINCT d.decided_by, ', ' ORDER BY d.decided_by) AS accepted_by
    FROM (SELECT DISTINCT run_id, lead_no FROM failing_item) AS f
    LEFT JOIN current_decision AS d
        ON d.inspection_run_id = f.run_id AND d.item_no = f.lead_no AND d.decision = 'accepted'
    GROUP BY f.run_id
),
said AS (
    SELECT p.run_id, p.verdict, CASE WHEN c.in_view IS NOT NULL THEN coalesce(f.findings, 0) END AS findings,
        c.confirmed + c.changed + c.contradicted AS checked, c.in_view, c.changed, c.contradicted, c.not_confirmed,
        c.undecidable, o.variant, f.accepted, f.accepted_by,
        CASE p.verdict WHEN 'accepted' THEN 'usable' WHEN 'ambiguous' THEN 'not unique' ELSE 'not found' END AS pose_verdict,
        CASE
            WHEN p.verdict <> 'accepted' THEN 'not enough seen'
            WHEN o.variant IS NOT NULL THEN 'another variant'
            WHEN c.changed + c.contradicted > 0 THEN 'deviates'
            WHEN 3 * c.confirmed >= 2 * c.in_view AND c.not_confirmed = 0 THEN 'as modelled'
            ELSE 'not enough seen'
        END AS part_verdict
    FROM inspection AS p
    LEFT JOIN counted AS c ON c.run_id = p.run_id
    LEFT JOIN found AS f ON f.run_id = p.run_id
    LEFT JOIN other AS o ON o.run_id = p.run_id
)
SELECT run_id, verdict, pose_verdict, part_verdict,
    CASE
        WHEN pose_verdict = 'not found' OR part_verdict IN ('deviates', 'another variant') THEN 'bad'
        WHEN part_verdict = 'as modelled' AND checked = in_view THEN 'good'
        ELSE 'warn'
    END AS mood,
    findings, checked, in_view, changed, contradicted, not_confirmed, undecidable, variant,
    concat('pose ', pose_verdict, '; part ', part_verdict,
        CASE WHEN part_verdict = 'deviates' THEN concat(' (', findings, CASE findings WHEN 1 THEN ' finding' ELSE ' findings' END,
            CASE WHEN accepted > 0 THEN concat(', ', CASE WHEN accepted < findings THEN concat(accepted, ' ') END, 'accepted by ', accepted_by) END, ')') END,
        CASE WHEN in_view > 0 THEN concat('; ', concat_ws(', ', concat(checked, ' of ', in_view, ' checked'),
            CASE WHEN changed > 0 THEN concat(changed, ' changed') END,
            CASE WHEN contradicted > 0 THEN concat(contradicted, ' contradicted') END,
            CASE WHEN not_confirmed > 0 THEN concat(not_confirmed, ' not confirmed') END,
            CASE WHEN undecidable > 0 THEN concat(undecidable, ' undecidable') END)) END,
        '; ' || variant) AS outcome
FROM said;

CREATE VIEW serial_inspection (  -- run: The stops of a physical part: every inspection that was begun with its serial number, however it ended.
    serial,  -- the physical part
    run_id,  -- the run
    ended,  -- usable, not unique or not found, as of its pose; failed, killed or running where it came to none; or pruned
    reason  -- why, one sentence; null while it runs
) AS
SELECT coalesce(i.serial, (r.parameters ->> 'serial')) AS serial, r.id AS run_id,
    CASE
        WHEN q.by_run_id IS NOT NULL THEN 'pruned'
        WHEN i.verdict = 'accepted' THEN 'usable'
        WHEN i.verdict = 'ambiguous' THEN 'not unique'
        WHEN i.verdict = 'refused' THEN 'not found'
        ELSE s.state
    END AS ended,
    CASE WHEN q.by_run_id IS NULL THEN coalesce(i.reason, e.message) ELSE concat('run ', q.by_run_id, ' removed what it found') END AS reason
FROM run AS r
JOIN run_state AS s ON s.run_id = r.id
LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead')
LEFT JOIN inspection AS i ON i.run_id = r.id
LEFT JOIN pruned_run AS q ON q.run_id = r.id AND q.what = 'runs'
WHERE r.kind = 'inspect' AND coalesce(i.serial, (r.parameters ->> 'serial')) IS NOT NULL;

CREATE VIEW serial_outcome (  -- localisation: How a physical part is by all inspections of it: what its report and `relmodel runs` would say in one line.
    serial,  -- the physical part
    part_verdict,  -- as modelled, deviates, another variant (by the newest usable stop that weighed some) or not enough seen: less than
        -- two thirds of all that its model has is confirmed, or something is not confirmed
    mood,  -- good, warn or bad: good only where all that the model has is checked
    findings,  -- how many there are
    checked,  -- parts and features that are checked
    features,  -- parts and features that its model has
    not_seen,  -- parts and features that no accepted inspection had in view
    stops,  -- inspections of it, however they ended
    usable_stops,  -- those whose pose is usable
    unusable,  -- of each other one its run, how it ended and why; null where there is none
    variant,  -- that its stops show another variant than the world has; null where they do not
    outcome  -- all of it in words
) AS
WITH counted AS (
    SELECT serial, count(*) AS features, count(CASE state WHEN 'confirmed' THEN 1 END) AS confirmed,
        count(CASE WHEN state IN ('changed', 'contradicted') THEN 1 END) AS failed,
        count(CASE state WHEN 'not_seen' THEN 1 END) AS not_seen,
        count(CASE state WHEN 'not_confirmed' THEN 1 END) AS not_confirmed
    FROM serial_evidence
    GROUP BY serial
),
stop AS (
    SELECT serial, count(*) AS stops, count(CASE ended WHEN 'usable' THEN 1 END) AS usable_stops,
        string_agg(CASE WHEN ended <> 'usable' THEN concat('run ', run_id, ', ', ended, ': ' || reason) END, '; ' ORDER BY run_id) AS unusable
    FROM serial_inspection
    GROUP BY serial
),
other AS (  -- how many stops ended in each way but usable, in words
    SELECT serial, string_agg(concat(CASE stops WHEN 1 THEN 'one' ELSE CAST(stops AS TEXT) END, ' ', ended), ', ' ORDER BY ended) AS ends
    FROM (SELECT serial, ended, count(*) AS stops FROM serial_inspection WHERE ended <> 'usable' GROUP BY serial, ended) AS counted_ends
    GROUP BY serial
),
found AS (
    SELECT s.serial, count(*) AS findings, count(d.run_id) AS accepted,
        string_agg(DISTINCT d.decided_by, ', ' ORDER BY d.decided_by) AS accepted_by
    FROM serial_finding AS s
    LEFT JOIN finding AS d ON d.run_id = s.run_id AND d.finding_no = s.finding_no AND d.decision = 'accepted'
    GROUP BY s.serial
),
weighed AS (
    SELECT DISTINCT ON (i.serial) i.serial, o.variant
    FROM inspection AS i
    JOIN inspection_outcome AS o ON o.run_id = i.run_id
    WHERE i.serial IS NOT NULL AND i.verdict = 'accepted' AND i.run_id IN (SELECT run_id FROM variant_evidence)
    ORDER BY i.serial, i.run_id DESC
),
said AS (
    SELECT s.serial, coalesce(f.findings, 0) AS findings, f.accepted, f.accepted_by, coalesce(c.confirmed + c.failed, 0) AS checked,
        coalesce(c.features, 0) AS features, coalesce(c.not_seen, 0) AS not_seen, s.stops, s.usable_stops, s.unusable, o.ends, w.variant,
        CASE WHEN w.variant IS NOT NULL THEN 'another variant' WHEN c.failed > 0 THEN 'deviates' WHEN 3 * c.confirmed >= 2 * c.features AND c.not_confirmed = 0 THEN 'as modelled' ELSE 'not enough seen' END AS part_verdict
    FROM stop AS s
    LEFT JOIN counted AS c ON c.serial = s.serial
    LEFT JOIN other AS o ON o.serial = s.serial
    LEFT JOIN found AS f ON f.serial = s.serial
    LEFT JOIN weighed AS w ON w.serial = s.serial
)
SELECT serial, part_verdict,
    CASE WHEN part_verdict IN ('deviates', 'another variant') THEN 'bad' WHEN part_verdict = 'as modelled' AND checked = features THEN 'good' ELSE 'warn' END AS mood,
    findings, checked, features, not_seen, stops, usable_stops, unusable, variant,
    concat('part ', part_verdict,
        CASE WHEN findings > 0 THEN concat(' (', findings, CASE findings WHEN 1 THEN ' finding' ELSE ' findings' END,
            CASE WHEN accepted > 0 THEN concat(', ', CASE WHEN accepted < findings THEN concat(accepted, ' ') END, 'accepted by ', accepted_by) END, ')') END,
        CASE WHEN features > 0 THEN concat('; ', checked, ' of ', features, ' checked, ', features - checked - not_seen, ' seen and not checked, ', not_seen,
            ' not yet seen') END, '; ', usable_stops, ' of ', stops, ' stops usable', ': ' || ends, CASE WHEN variant IS NOT NULL THEN concat('; ', variant) END) AS outcome
FROM said;

CREATE VIEW run_summary (  -- run: Every run with how it ended, and the verdict and what is not as modelled where it was an inspection.
    run_id,  -- the run
    kind,  -- what was run
    began_at,  -- when the run began
    seconds,  -- how long it took, s; null while it runs, and where it was killed
    state,  -- running, finished, failed or killed
    serial,  -- serial number of the physical part that an inspection was of; null where none was given
    verdict,  -- verdict of an inspection: accepted, ambiguous or refused; null of other runs
    pose_verdict,  -- usable, not unique or not found, as in inspection_outcome
    part_verdict,  -- as modelled, deviates, another variant or not enough seen, likewise
    findings,  -- things that are surely not as modelled, likewise
    checked,  -- parts and features in view that are checked, likewise
    in_view,  -- parts and features in view, likewise
    changed,  -- parts and features that are there in another size or place, as in inspection_outcome
    contradicted,  -- parts and features in whose place something else is, likewise
    not_confirmed,  -- parts and features that should be seen and are not, likewise
    undecidable,  -- parts and features of which the pictures do not tell, likewise
    variant,  -- that the pictures show another variant than the world has, likewise
    outcome,  -- both verdicts, counts and variant in words, likewise; or by which run it was pruned
    message,  -- the error or the reason
    evidence_ratio  -- evidence found in the images over what a right pose would find; null where it was no inspection
) AS
SELECT
    r.id AS run_id, r.kind, r.began_at, e.seconds, s.state, coalesce(i.serial, (r.parameters ->> 'serial')) AS serial, o.verdict, o.pose_verdict, o.part_verdict, o.findings,
    o.checked, o.in_view, o.changed, o.contradicted, o.not_confirmed, o.undecidable, o.variant,
    coalesce(o.outcome, 'pruned by run ' || CAST(q.by_run_id AS TEXT)) AS outcome, e.message, p.evidence_ratio
FROM run AS r
JOIN run_state AS s ON s.run_id = r.id
LEFT JOIN run_event AS e ON e.run_id = r.id AND e.kind IN ('ended', 'found_dead')
LEFT JOIN pose AS p ON p.run_id = r.id
LEFT JOIN inspection AS i ON i.run_id = r.id
LEFT JOIN inspection_outcome AS o ON o.run_id = r.id
LEFT JOIN pruned_run AS q ON q.run_id = r.id AND q.what = 'runs';

CREATE VIEW pose_world (  -- localisation: Where the rig was in the world, and how sure that is along and about the world's axes; pose has the same in the rig's
    -- frame.
    run_id,  -- the run
    verdict,  -- accepted, ambiguous or refused
    x, y, z,  -- x, y and z of the rig's origin in the world, mm
    sigma_x, sigma_y, sigma_z,  -- standard deviation of the rig's origin along the world's x, y and z, mm
    sigma_rx, sigma_ry, sigma_rz,  -- standard deviation of the rotation about the world's x, y and z direction, rad
    covariance  -- 6x6 row-major: shift of the rig's origin in mm, then small rotation about it in rad, both in the world's axes: each 3x3 block of
        -- pose.covariance is R block R^T, R the rotation of world_from_rig
) AS
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

CREATE VIEW matched_arc (  -- localisation: Pairs of model arc and image arc that the best hypothesis of each run took, with residual (px).
    run_id,  -- the run
    camera,  -- name of the camera in the rig
    path,  -- path of the placed part
    view_kind,  -- sharp, smooth or silhouette
    arc_no,  -- the arc in the shape of the part; null for a silhouette
    surface_no,  -- the surface that a silhouette is of; null for an arc
    occurrence_id,  -- the placed part
    view_arc_no,  -- the model arc in the view
    image_arc_no,  -- the image arc in the extraction
    residual,  -- rms distance of the image arc from the projected model arc, px
    angle,  -- mean angle between them, rad
    overlap  -- share of the image arc that lies along the model arc, 0 to 1
) AS
SELECT
    c.run_id, v.camera, o.name || n.path AS path, a.kind AS view_kind, a.arc_no, a.surface_no, a.occurrence_id,
    c.view_arc_no, c.image_arc_no, c.residual, c.angle, c.overlap
FROM correspondence AS c
JOIN view_arc AS a ON a.run_id = c.run_id AND a.view_no = c.view_no AND a.view_arc_no = c.view_arc_no
JOIN inspection_image AS v ON v.run_id = c.run_id AND v.view_no = c.view_no
JOIN placed_object AS o ON o.object_no = a.occurrence_id >> 28  -- as placed_node, whose name comes after this view's
JOIN object_node AS n ON n.object_id = o.object_id AND n.node_no = a.occurrence_id & 268435455
WHERE c.hypothesis_no = 0 AND c.accepted;

CREATE VIEW camera_residual (  -- localisation: How far the edge points that measured a pose lie from the model at it, by camera: the mean of edge_measurement, in
    -- which each point counts by its weight.
    run_id,  -- the run
    camera,  -- name of the camera in the rig
    points,  -- edge points of more weight than 0
    model_arcs,  -- of how many model arcs they are
    weight,  -- sum of their weights: as many points as the robust loss left
    rms_px,  -- weighted root mean square of their residuals, px: sqrt(sum(weight * residual^2) / sum(weight))
    rms_sigmas  -- the same of residual over sigma: about 1 where the points err as expected
) AS
SELECT m.run_id, v.camera, count(*) AS points, count(DISTINCT m.view_arc_no) AS model_arcs, sum(m.weight) AS weight,
    sqrt(sum(m.weight * m.residual * m.residual) / sum(m.weight)) AS rms_px,
    sqrt(sum(m.weight * m.residual * m.residual / (m.sigma * m.sigma)) / sum(m.weight)) AS rms_sigmas
FROM edge_measurement AS m
JOIN inspection_image AS v ON v.run_id = m.run_id AND v.view_no = m.view_no
WHERE m.weight > 0
GROUP BY m.run_id, v.camera;

CREATE VIEW rejected_arc (  -- localisation: Image arcs that the best hypothesis of a run left without a model arc, with the nearest candidate and why it was not
    -- taken; no_candidate: no model arc was near.  Of runs that matched arcs (relmodel inspect --match).
    run_id,  -- the run
    camera,  -- name of the camera in the rig
    image_arc_no,  -- the image arc in the extraction
    kind,  -- line, circular, elliptic or free
    length,  -- its length, px
    contrast,  -- its contrast, grey levels
    reason,  -- why the nearest candidate was not taken, or no_candidate
    residual,  -- rms distance from the nearest candidate, px; null where there is none
    view_arc_no  -- the nearest candidate in the view
) AS
WITH best AS (
    SELECT
        c.run_id, v.camera, c.image_arc_no, c.reason, c.residual, c.view_arc_no,
        max(CASE WHEN c.accepted THEN 1 ELSE 0 END) OVER (PARTITION BY c.run_id, v.camera, c.image_arc_no) AS taken,
        row_number() OVER (PARTITION BY c.run_id, v.camera, c.image_arc_no ORDER BY c.residual, c.view_arc_no) AS place
    FROM correspondence AS c
    JOIN inspection_image AS v ON v.run_id = c.run_id AND v.view_no = c.view_no
    WHERE c.hypothesis_no = 0
)
SELECT
    i.run_id, i.camera, a.image_arc_no, a.kind, a.length, a.contrast,
    coalesce(best.reason, 'no_candidate') AS reason, best.residual, best.view_arc_no
FROM inspection_image AS i
JOIN (SELECT DISTINCT run_id FROM problem WHERE kind = 'localisation') AS m ON m.run_id = i.run_id
JOIN image_arc AS a ON a.extraction_id = i.extraction_id
LEFT JOIN best ON best.run_id = i.run_id AND best.camera = i.camera AND best.image_arc_no = a.image_arc_no AND best.place = 1
WHERE coalesce(best.taken, 0) = 0;

CREATE VIEW unmatched_in_stereo (  -- matching: Arcs of both images of a pair that stereo left without a partner: they weigh less in localisation.
    run_id,  -- the run
    extraction_id,  -- extraction of the image
    image_arc_no,  -- the image arc in the extraction
    reason  -- of an arc of the left image as in assignment; of the right one no_candidate, or not_taken: none of the left arcs that it could be took
        -- it
) AS
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

CREATE VIEW attribute_log (  -- run: Every value that an attribute ever had, of every level: what, when and by whom.
    level,  -- world, object, part, surface or arc
    owner_id,  -- the world, object or part; of a surface or arc its shape
    surface_no,  -- the surface in the shape; null of other levels
    arc_no,  -- the arc in the shape; null of other levels
    name,  -- name of the attribute
    value,  -- the value as text
    unit,  -- its unit
    source,  -- where the value comes from: file, derived, user
    run_id,  -- the run that stated it
    stated_at,  -- when that run began
    stated_by  -- name of the user who ran relmodel set; null of other runs
) AS
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
