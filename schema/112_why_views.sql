-- Why: what was decided of each thing that a run looked at, as sentences that follow from its rows.  A view builds only
-- on views of names before its own, for DuckDB's export writes them by name.

CREATE VIEW why_arc (  -- localisation: What was decided of each image arc of an inspection and each model arc that came near it, at the best hypothesis: one row a
    -- pair, one for an arc that nothing came near.
    run_id,  -- the run
    camera,  -- name of the camera in the rig
    image_arc_no,  -- the image arc in the extraction
    view_arc_no,  -- the model arc in the view; null where none came near
    path,  -- path of the placed part that it belongs to
    element,  -- which edge or outline of the part it is, in words
    taken,  -- whether the pair was taken
    rule,  -- assigned, or which rule the pair failed: orientation, distance, overlap, unrelated, better_elsewhere, covered; no_candidate
    value,  -- what the rule looks at: degrees between the two, share that lies along the edge, else px (rms) apart
    gate,  -- what that was compared with, in the same unit
    sentence  -- the decision in words
) AS
WITH named AS (
    SELECT a.run_id, a.view_no, a.view_arc_no, i.camera, o.path, i.extraction_id,
        CASE WHEN a.kind = 'silhouette' THEN concat('the outline of face ', a.surface_no)
            ELSE concat('the ', a.kind, ' edge ', a.arc_no) END AS element
    FROM view_arc AS a
    JOIN inspection_image AS i ON i.run_id = a.run_id AND i.view_no = a.view_no
    JOIN placed_node AS o ON o.id = a.occurrence_id
),
criterion AS (
    SELECT run_id, max(CASE name WHEN 'min_overlap' THEN value END) AS min_overlap,
        max(CASE name WHEN 'gate_sigma' THEN value END) AS gate_sigma,
        max(CASE name WHEN 'reach_px' THEN value END) AS reach
    FROM threshold
    WHERE decision = 'correspondence'
    GROUP BY run_id
),
pair AS (
    SELECT c.run_id, n.camera, n.extraction_id, c.image_arc_no, c.view_arc_no, n.path, n.element, c.accepted, c.reason,
        c.residual, c.gate, degrees(c.angle) AS angle, degrees(c.angle_gate) AS angle_gate, c.overlap
    FROM correspondence AS c
    JOIN named AS n ON n.run_id = c.run_id AND n.view_no = c.view_no AND n.view_arc_no = c.view_arc_no
    WHERE c.hypothesis_no = 0
)
SELECT i.run_id, i.camera, a.image_arc_no, p.view_arc_no, p.path, p.element, coalesce(p.accepted, FALSE) AS taken,
    coalesce(p.reason, 'no_candidate') AS rule,
    CASE p.reason WHEN 'orientation' THEN p.angle WHEN 'overlap' THEN p.overlap ELSE p.residual END AS value,
    CASE coalesce(p.reason, '')
        WHEN '' THEN h.reach WHEN 'orientation' THEN p.angle_gate WHEN 'overlap' THEN h.min_overlap
        ELSE p.gate END AS gate,
    CASE
        WHEN p.reason IS NULL AND m.run_id IS NULL THEN 'there is no row of what it was compared with: the run did not match arcs (relmodel inspect --match), found no pose, or kept only its decisions'
        WHEN p.reason IS NULL THEN concat('no edge or outline of the model lies within ',
            CAST(h.reach AS NUMERIC(18, 1)), ' px of it at the pose found')
        ELSE concat(
            CASE WHEN p.accepted THEN 'it is ' ELSE 'it is not ' END, p.element, ' of ', p.path, ': ',
            CASE p.reason
                WHEN 'orientation' THEN concat(CAST(p.angle AS NUMERIC(18, 1)), ' degrees lie between the two, and ',
                    CAST(p.angle_gate AS NUMERIC(18, 1)), ' are allowed')
                WHEN 'distance' THEN concat('they are ', CAST(p.residual AS NUMERIC(18, 2)),
                    ' px (rms) apart, beyond the gate of ', CAST(p.gate AS NUMERIC(18, 2)), ' px (',
                    CAST(h.gate_sigma AS NUMERIC(18, 1)), ' sigma of pose, arc and edge together)')
                WHEN 'overlap' THEN concat(CAST(100 * p.overlap AS NUMERIC(18, 0)), ' percent of it lie along the edge, and ',
                    CAST(100 * h.min_overlap AS NUMERIC(18, 0)), ' are needed')
                ELSE concat('they are ', CAST(p.residual AS NUMERIC(18, 2)), ' px (rms) apart (gate ',
                    CAST(p.gate AS NUMERIC(18, 2)), ' px) at ', CAST(p.angle AS NUMERIC(18, 1)), ' degrees, and ',
                    CAST(100 * p.overlap AS NUMERIC(18, 0)), ' percent of its ', CAST(a.length AS NUMERIC(18, 1)),
                    ' px lie along the edge',
                    CASE p.reason
                        WHEN 'unrelated' THEN '; but its relations are not those of the edge'
                        WHEN 'better_elsewhere' THEN '; but another edge has its relations at less cost'
                        WHEN 'covered' THEN '; but another image arc lies nearer to the same stretch'
                        ELSE '' END)
            END)
    END AS sentence
FROM inspection_image AS i
JOIN image_arc AS a ON a.extraction_id = i.extraction_id
LEFT JOIN criterion AS h ON h.run_id = i.run_id
LEFT JOIN (SELECT DISTINCT run_id FROM problem WHERE kind = 'localisation') AS m ON m.run_id = i.run_id
LEFT JOIN pair AS p ON p.run_id = i.run_id AND p.camera = i.camera AND p.image_arc_no = a.image_arc_no;

CREATE VIEW why_image_arc (  -- localisation: The final decision of each image arc of an inspection, one row an arc: the model arc that it is, else the nearest and
    -- why not.
    run_id,  -- the run
    camera,  -- name of the camera in the rig
    image_arc_no,  -- the image arc in the extraction
    matched,  -- whether it was taken for a model arc
    rule,  -- the rule that decided
    view_arc_no,  -- the model arc that it is, else the one compared with it; null where none came near
    sentence  -- the decision in words
) AS
SELECT w.run_id, w.camera, w.image_arc_no, w.taken AS matched, w.rule, w.view_arc_no, w.sentence
FROM (
    SELECT y.*, row_number() OVER (
        PARTITION BY y.run_id, y.camera, y.image_arc_no
        ORDER BY CASE WHEN y.taken THEN 0 ELSE 1 END, y.value, y.view_arc_no) AS place
    FROM why_arc AS y
) AS w
WHERE w.place = 1;

CREATE VIEW why_view_arc (  -- localisation: What the account of edges says of each model arc that a view predicts, one row an arc.
    run_id,  -- the run
    camera,  -- name of the camera in the rig
    view_arc_no,  -- the model arc in the view
    path,  -- path of the placed part
    kind,  -- sharp, smooth or silhouette
    length,  -- its visible length, px
    supported_px,  -- of that, what edge elements support
    rule,  -- found: likelier there than not; missing: 20 to 1 against it; faint: neither, so short it is or so seldom such edges show; crowded:
        -- too near to others or to the border; blend: smooth, so that nothing is expected; or unseen: no account was taken
    sentence  -- the decision in words
) AS
SELECT j.run_id, j.camera, j.view_arc_no, j.path, j.kind, j.length, j.supported_px, j.rule,
    concat(j.element, ' of ', j.path, ', ', CAST(j.length AS NUMERIC(18, 1)), ' px long in the ', j.camera, ' picture, ',
        CASE j.rule
            WHEN 'blend' THEN 'is a blend, of which no edge is expected'
            WHEN 'unseen' THEN 'was not looked for: the pose was refused, or the run kept only its decisions'
            WHEN 'crowded' THEN 'lies too near to other edges or to the border to be told'
            ELSE concat('is ', j.rule, ': edges lie along ', CAST(j.supported_px AS NUMERIC(18, 1)), ' of the ',
                CAST(j.distinct_px AS NUMERIC(18, 1)), ' px that can be told from others, and ',
                CAST(100 * j.shows AS NUMERIC(18, 0)), ' percent of such edges show in this picture (log odds ',
                CAST(j.log_odds AS NUMERIC(18, 1)), ')')
        END) AS sentence
FROM (
    SELECT a.*, v.camera, o.path,
        CASE WHEN a.kind = 'silhouette' THEN concat('the outline of face ', a.surface_no)
            ELSE concat('the ', a.kind, ' edge ', a.arc_no) END AS element,
        CASE WHEN a.kind = 'smooth' THEN 'blend' WHEN a.distinct_px IS NULL THEN 'unseen' WHEN a.distinct_px <= 0 THEN 'crowded'
            WHEN a.log_odds > 0 THEN 'found' WHEN a.log_odds < -3 THEN 'missing' ELSE 'faint' END AS rule
    FROM view_arc AS a
    JOIN inspection_image AS v ON v.run_id = a.run_id AND v.view_no = a.view_no
    JOIN placed_node AS o ON o.id = a.occurrence_id
) AS j;

CREATE VIEW why_verdict (  -- localisation: The rules of a verdict, each with what was found and what that was compared with; accepted is what passes all.
    run_id,  -- the run
    rule_no,  -- ordinal of the rule
    rule,  -- likely, prior, apart, translation, rotation, rivals, share, cameras or calibration
    value,  -- what was found: probability, sigmas, mm, degrees or how many
    gate,  -- what that was compared with, in the same unit
    holds,  -- whether the pose passes
    verdict,  -- the verdict
    sentence  -- the rule in words
) AS
WITH statistic AS (
    SELECT run_id,
        max(CASE name WHEN 'evidence' THEN value END) AS evidence, max(CASE name WHEN 'share' THEN value END) AS share,
        max(CASE name WHEN 'agreement' THEN value END) AS agreement, max(CASE name WHEN 'apart' THEN value END) AS apart,
        max(CASE name WHEN 'chance_level' THEN value END) AS chance_level, max(CASE name WHEN 'chance_scale' THEN value END) AS chance_scale,
        max(CASE name WHEN 'prior_sigma' THEN value END) AS prior_sigma, max(CASE name WHEN 'prior_mm' THEN value END) AS prior_mm,
        max(CASE name WHEN 'prior_left_out' THEN value END) AS prior_left_out, max(CASE name WHEN 'outline_px' THEN value END) AS outline_px,
        max(CASE name WHEN 'outline_contrast' THEN value END) AS outline_contrast, max(CASE name WHEN 'sigma_mm' THEN value END) AS sigma_mm,
        max(CASE name WHEN 'sigma_rad' THEN value END) AS sigma_rad, max(CASE name WHEN 'likely' THEN value END) AS likely,
        max(CASE name WHEN 'rivals' THEN value END) AS rivals, max(CASE name WHEN 'absent' THEN value END) AS absent,
        max(CASE name WHEN 'absent_anywhere' THEN value END) AS absent_anywhere, max(CASE name WHEN 'rival_face_mm' THEN value END) AS face_mm,
        max(CASE name WHEN 'features' THEN value END) AS features, max(CASE name WHEN 'faces_off' THEN value END) AS faces_off, max(CASE name WHEN 'calibration' THEN value END) AS calibration,
        max(CASE name WHEN 'calibration_limit' THEN value END) AS calibration_limit, min(CASE WHEN starts_with(name, 'sees ') THEN value END) AS sees
    FROM verdict_statistic
    GROUP BY run_id
),
criterion AS (
    SELECT run_id,
        max(CASE name WHEN 'min_posterior' THEN value END) AS min_posterior, max(CASE name WHEN 'searched_rarity' THEN value END) AS searched_rarity,
        max(CASE name WHEN 'max_sigma' THEN value END) AS max_sigma, max(CASE name WHEN 'max_apart_sigma' THEN value END) AS max_apart,
        max(CASE name WHEN 'max_absent_odds' THEN value END) AS max_absent, max(CASE name WHEN 'max_absent_odds_anywhere' THEN value END) AS max_absent_anywhere,
        max(CASE name WHEN 'max_features_odds' THEN value END) AS max_features, max(CASE name WHEN 'max_faces_off' THEN value END) AS max_faces_off, max(CASE name WHEN 'least_camera_odds' THEN value END) AS least_odds,
        max(CASE name WHEN 'needs_translation_mm' THEN value END) AS needs_mm, max(CASE name WHEN 'needs_rotation' THEN value END) AS needs_rad
    FROM threshold WHERE decision = 'verdict' GROUP BY run_id
),
rule AS (
    SELECT s.run_id, 0 AS rule_no, 'likely' AS rule, s.likely AS value, h.min_posterior AS gate,
        s.likely >= h.min_posterior AS holds, concat('that the model is there is ',
            CAST(100 * s.likely AS NUMERIC(18, 2)), ' percent probable by the pictures, and ',
            CAST(100 * h.min_posterior AS NUMERIC(18, 2)), ' percent are needed: evidence of ',
            CAST(s.evidence AS NUMERIC(18, 0)), ' where poses elsewhere reach ',
            CAST(s.chance_level + s.chance_scale * h.searched_rarity AS NUMERIC(18, 0)), ', ',
            CAST(100 * least(s.share, 1) AS NUMERIC(18, 0)), ' percent of the edges expected, ',
            CAST(100 * s.agreement AS NUMERIC(18, 0)), ' percent of those found on the model''s, a contrast of ',
            CAST(s.outline_contrast AS NUMERIC(18, 1)), ' along ', CAST(s.outline_px AS NUMERIC(18, 0)), ' px of outline',
            CASE WHEN s.prior_sigma IS NULL THEN ''
                ELSE concat(', ', CAST(s.prior_sigma AS NUMERIC(18, 1)), ' sigma from the prior') END) AS sentence
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id
    UNION ALL
    SELECT s.run_id, 1, 'prior', s.prior_sigma, h.max_sigma, s.prior_sigma <= h.max_sigma OR coalesce(s.prior_left_out, 0) = 1,
        concat('the pose lies ', CAST(s.prior_sigma AS NUMERIC(18, 2)), ' sigma from the prior, and ',
            CAST(h.max_sigma AS NUMERIC(18, 1)), ' are allowed',
            CASE WHEN s.prior_mm IS NULL THEN ''
                ELSE concat('; it was found without it, ', CAST(s.prior_mm AS NUMERIC(18, 0)), ' mm away',
                    CASE WHEN s.prior_left_out = 1 THEN ', and the pictures were to be believed' ELSE '' END) END)
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id WHERE s.prior_sigma IS NOT NULL
    UNION ALL
    SELECT s.run_id, 2, 'apart', s.apart, h.max_apart, s.apart <= h.max_apart,
        concat('the cameras disagree by ', CAST(s.apart AS NUMERIC(18, 2)), ' sigma, and ',
            CAST(h.max_apart AS NUMERIC(18, 1)), ' are allowed')
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id
    UNION ALL
    SELECT s.run_id, 3, 'translation', 2 * s.sigma_mm, h.needs_mm, 2 * s.sigma_mm <= h.needs_mm,
        concat('the place is known to ', CAST(2 * s.sigma_mm AS NUMERIC(18, 3)), ' mm (two sigma, worst direction), and ',
            CAST(h.needs_mm AS NUMERIC(18, 3)), ' mm are needed')
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id
    UNION ALL
    SELECT s.run_id, 4, 'rotation', degrees(2 * s.sigma_rad), degrees(h.needs_rad), 2 * s.sigma_rad <= h.needs_rad,
        concat('the turn is known to ', CAST(degrees(2 * s.sigma_rad) AS NUMERIC(18, 4)),
            ' degrees (two sigma, worst direction), and ', CAST(degrees(h.needs_rad) AS NUMERIC(18, 4)), ' are needed')
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id
    UNION ALL
    SELECT s.run_id, 5, 'rivals', s.rivals, 0, s.rivals = 0,
        CASE WHEN s.rivals = 0 THEN 'no other pose explains the pictures about equally well'
            ELSE concat(CAST(s.rivals AS INTEGER), ' other poses explain the pictures about equally well') END
    FROM statistic AS s
    UNION ALL
    SELECT s.run_id, 6, 'edges', e.value, e.gate, e.value <= e.gate,
        concat('log odds of ', CAST(e.value AS NUMERIC(18, 1)), ' that ', e.what, ', and ', CAST(e.gate AS NUMERIC(18, 1)), ' are allowed')
    FROM statistic AS s
    JOIN criterion AS h ON h.run_id = s.run_id
    CROSS JOIN LATERAL (
        SELECT s.absent_anywhere AS value, h.max_absent_anywhere AS gate, 'edges of the model are not there which should show' AS what
        WHERE s.absent_anywhere > h.max_absent_anywhere
        UNION ALL
        SELECT s.absent, h.max_absent, 'edges of the model are not there which should show, beside what has moved or is told missing'
        WHERE s.absent IS NOT NULL
        UNION ALL
        SELECT s.features, h.max_features, 'the features that differ are those of another object'
        WHERE s.features > h.max_features
    ) AS e
    UNION ALL
    SELECT s.run_id, 7, 'cameras', s.sees, h.least_odds, s.sees >= h.least_odds,
        concat('the camera that sees least of the model sees it with log odds of ', CAST(s.sees AS NUMERIC(18, 1)), ', and ',
            CAST(h.least_odds AS NUMERIC(18, 1)), ' are needed')
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id WHERE s.sees IS NOT NULL
    UNION ALL
    SELECT s.run_id, 8, 'calibration', s.calibration, s.calibration_limit, s.calibration <= s.calibration_limit,
        concat('what the pictures show of the cameras lies up to ', CAST(s.calibration AS NUMERIC(18, 1)),
            ' sigma from the rig''s file, and ', CAST(s.calibration_limit AS NUMERIC(18, 1)), ' are allowed')
    FROM statistic AS s WHERE s.calibration IS NOT NULL
    UNION ALL
    SELECT s.run_id, 9, 'faces', s.face_mm, h.needs_mm, false,
        concat('a face lies ', CAST(s.face_mm AS NUMERIC(18, 1)), ' mm from its place, further than the ',
            CAST(h.needs_mm AS NUMERIC(18, 1)), ' mm needed, and as many faces say that it is the others that do')
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id WHERE s.face_mm IS NOT NULL
    UNION ALL
    SELECT s.run_id, 10, 'fit', s.faces_off, h.max_faces_off, s.faces_off <= h.max_faces_off,
        concat('faces lie ', CAST(s.faces_off AS NUMERIC(18, 2)), ' standard deviations (rms) from their places, without the farthest, and ',
            CAST(h.max_faces_off AS NUMERIC(18, 1)), ' are allowed')
    FROM statistic AS s JOIN criterion AS h ON h.run_id = s.run_id WHERE s.faces_off IS NOT NULL
)
SELECT r.run_id, r.rule_no, r.rule, r.value, r.gate, r.holds, p.verdict, r.sentence
FROM rule AS r
JOIN pose AS p ON p.run_id = r.run_id;

CREATE VIEW why_verdict_cause (  -- localisation: Why an inspection's pose is most likely not accepted, and what to do next: one row an inspection whose pose is not.
    run_id,  -- the run
    cause,  -- picture (unusable), camera (does not see the model), prior (looks past the object or is contradicted), nothing (no pose is
        -- found), little (of the object is in view), repeats, standpoint (contradicts the others), calibration, precision, object (another one, or another variant), or
        -- alike (loaded objects or variants that the pictures do not distinguish)
    likely_cause,  -- that in words, with each number next to its limit
    advice  -- what to do next
) AS
WITH failed AS (
    SELECT run_id,
        max(CASE rule WHEN 'likely' THEN sentence END) AS likely, max(CASE rule WHEN 'prior' THEN sentence END) AS prior,
        max(CASE rule WHEN 'apart' THEN sentence END) AS apart,
        string_agg(CASE WHEN rule IN ('translation', 'rotation') THEN sentence END, '; ' ORDER BY rule_no) AS precise,
        max(CASE rule WHEN 'rivals' THEN sentence END) AS rivals, max(CASE rule WHEN 'edges' THEN sentence END) AS edges,
        max(CASE WHEN rule IN ('faces', 'fit') THEN sentence END) AS faces, max(CASE rule WHEN 'cameras' THEN sentence END) AS cameras,
        max(CASE rule WHEN 'calibration' THEN sentence END) AS calibration
    FROM why_verdict WHERE NOT holds GROUP BY run_id
),
limits AS (
    SELECT run_id,
        max(CASE name WHEN 'least_edges' THEN value END) AS least_edges, max(CASE name WHEN 'most_blur_px' THEN value END) AS most_blur_px,
        max(CASE name WHEN 'most_saturated' THEN value END) AS most_saturated, max(CASE name WHEN 'most_mosaic' THEN value END) AS most_mosaic
    FROM threshold WHERE decision = 'picture' GROUP BY run_id
),
unusable AS (
    SELECT i.run_id, string_agg(i.camera, ' and ' ORDER BY i.camera) AS cameras
    FROM inspection_image AS i
    JOIN limits AS l ON l.run_id = i.run_id
    WHERE i.stale_run_id IS NOT NULL OR i.edges < l.least_edges OR i.blur_px > l.most_blur_px OR i.saturated > l.most_saturated
        OR i.mosaic > l.most_mosaic
    GROUP BY i.run_id
),
seeing AS (
    SELECT run_id, max(value) AS best
    FROM verdict_statistic WHERE starts_with(name, 'sees ') GROUP BY run_id
),
-- Log odds of the best pose were all found that is expected there: what view and model could say at most.
most AS (
    SELECT s.run_id, ln(t.needed / (1 - t.needed)) AS needed,
        least(t.offset_odds + t.rarity_weight * least(s.rarity, t.most_rarity) + t.share_weight + t.agreement_weight,
            CASE WHEN s.rarity <= t.searched_rarity THEN 0 END) AS odds
    FROM (
        SELECT e.run_id, (e.expected - c.level) / c.scale AS rarity
        FROM (
            SELECT run_id, sum(expected) AS expected FROM hypothesis_support WHERE hypothesis_no = 0 GROUP BY run_id
        ) AS e
        JOIN (
            SELECT run_id, max(CASE name WHEN 'chance_level' THEN value END) AS level,
                max(CASE name WHEN 'chance_scale' THEN value END) AS scale
            FROM verdict_statistic
            GROUP BY run_id
        ) AS c ON c.run_id = e.run_id
    ) AS s
    JOIN (
        SELECT run_id,
            max(CASE name WHEN 'offset' THEN value END) AS offset_odds, max(CASE name WHEN 'weights[0]' THEN value END) AS rarity_weight,
            max(CASE name WHEN 'weights[1]' THEN value END) AS share_weight, max(CASE name WHEN 'weights[2]' THEN value END) AS agreement_weight,
            max(CASE name WHEN 'searched_rarity' THEN value END) AS searched_rarity, max(CASE name WHEN 'most_rarity' THEN value END) AS most_rarity,
            max(CASE name WHEN 'min_posterior' THEN value END) AS needed
        FROM threshold
        WHERE decision = 'verdict'
        GROUP BY run_id
    ) AS t ON t.run_id = s.run_id
),
judged AS (
    SELECT i.run_id, f.likely, f.prior, f.apart, f.precise, f.rivals, f.edges, f.faces, f.cameras,
        coalesce(d.sentence, f.calibration) AS calibration, p.name AS standpoint, u.cameras AS pictures, i.reason,
        CASE
            WHEN p.name IS NOT NULL THEN 'standpoint'
            WHEN u.run_id IS NOT NULL THEN 'picture'
            WHEN d.run_id IS NOT NULL THEN 'calibration'
            WHEN i.covariance IS NULL AND i.m00 IS NULL THEN 'nothing'
            WHEN i.covariance IS NULL THEN 'prior'
            WHEN f.cameras IS NOT NULL AND s.best > 0 THEN 'camera'
            WHEN f.likely IS NOT NULL AND m.odds < m.needed THEN 'little'
            WHEN f.likely IS NOT NULL THEN 'object'
            WHEN f.calibration IS NOT NULL THEN 'calibration'
            WHEN f.edges IS NOT NULL OR f.faces IS NOT NULL THEN 'object'
            WHEN f.prior IS NOT NULL THEN 'prior'
            WHEN f.rivals IS NOT NULL THEN 'repeats'
            WHEN f.apart IS NOT NULL THEN 'calibration'
            WHEN f.precise IS NOT NULL THEN 'precision'
            ELSE 'alike'
        END AS cause
    FROM inspection AS i
    LEFT JOIN failed AS f ON f.run_id = i.run_id
    LEFT JOIN unusable AS u ON u.run_id = i.run_id
    LEFT JOIN most AS m ON m.run_id = i.run_id
    LEFT JOIN seeing AS s ON s.run_id = i.run_id
    LEFT JOIN inspection_sentence AS d ON d.run_id = i.run_id AND d.kind = 'rig'
    LEFT JOIN (
        SELECT s.run_id, max(s.name) AS name
        FROM standpoint AS s
        JOIN verdict_statistic AS v ON v.run_id = s.run_id AND v.name = 'calibration' AND v.value = s.sigmas
        GROUP BY s.run_id
    ) AS p ON p.run_id = i.run_id AND f.calibration IS NOT NULL
    WHERE i.verdict <> 'accepted'
)
SELECT j.run_id, j.cause,
    CASE j.cause
        WHEN 'picture' THEN concat('the picture of ', j.pictures, ' cannot be used')
        WHEN 'nothing' THEN 'nothing in the pictures says where the object is'
        WHEN 'camera' THEN concat('a camera does not see the object: ', j.cameras)
        WHEN 'little' THEN concat('too little of the object is in view to be sure of it: ', j.likely)
        WHEN 'object' THEN concat('the pictures show something else, or the object as the model does not have it: ', coalesce(j.likely, j.edges, j.faces))
        WHEN 'prior' THEN CASE WHEN j.prior IS NULL THEN 'the prior looks past the object'
            ELSE concat('the prior does not hold: ', j.prior) END
        WHEN 'repeats' THEN concat('what is in view repeats in the object: ', j.rivals)
        WHEN 'standpoint' THEN concat('the standpoints contradict each other, most of all ', j.standpoint, ': ', j.calibration)
        WHEN 'calibration' THEN concat('the rig is not as its file says: ', coalesce(j.calibration, j.apart))
        WHEN 'precision' THEN concat('the pose is not known as well as asked: ', j.precise)
        WHEN 'alike' THEN concat('what is in view is alike in several loaded objects or variants: ', j.reason)
    END AS likely_cause,
    CASE j.cause
        WHEN 'picture' THEN 'take it again: in focus, exposed so that little of it is white, with nothing before the lens, and demosaiced'
        WHEN 'nothing' THEN 'give a prior, a second picture, or a view with round holes or straight edges of the object'
        WHEN 'camera' THEN 'look at its picture; --ignore-blind-camera answers by the others'
        WHEN 'little' THEN 'move the rig until more of the object is in view, or nearer to it'
        WHEN 'object' THEN 'run it with --against to see which loaded object and variant the pictures show, or look at --overlay'
        WHEN 'prior' THEN CASE WHEN j.prior IS NULL THEN 'correct the prior or where the world has the object, or inspect without --prior'
            ELSE 'correct the prior, or trust the pictures with --believe-pictures' END
        WHEN 'repeats' THEN 'move the rig until an end of the object or something that does not repeat is in view, or give a prior that rules the others out'
        WHEN 'standpoint' THEN concat('correct where it is stated to be, or leave it out with --ignore-standpoint ', j.standpoint)
        WHEN 'calibration' THEN 'give the pictures as the camera took them, neither scaled nor cropped; calibrate the rig again, or state in its sigma how well it is known'
        WHEN 'alike' THEN 'move the rig until what distinguishes them is in view'
        WHEN 'precision' THEN 'ask for less with --needs, move nearer, add a camera, or state in the rig''s sigma how well it is calibrated'
    END AS advice
FROM judged AS j;

CREATE VIEW why_hypothesis (  -- localisation: Each pose that was refined, and why it is the best, a rival of it, or was dropped.
    run_id,  -- the run
    hypothesis_no,  -- the hypothesis
    rule,  -- best, rival, symmetric, less_evidence, far_from_prior or account
    found,  -- evidence that it gathers in all pictures, of edges and of greys next to outlines
    least,  -- evidence that a rival has more than
    distance,  -- sigmas from the prior; null where there is none
    sentence  -- the decision in words
) AS
WITH gathered AS (
    SELECT h.run_id, h.hypothesis_no, h.cost, h.distance, h.is_symmetric, h.account_log_odds, coalesce(0.5 * h.distance * h.distance, 0) AS believed,
        sum(s.found) + h.outline_evidence AS found
    FROM hypothesis AS h
    JOIN hypothesis_support AS s ON s.run_id = h.run_id AND s.hypothesis_no = h.hypothesis_no
    GROUP BY h.run_id, h.hypothesis_no, h.cost, h.distance, h.is_symmetric, h.account_log_odds, h.outline_evidence
),
ranked AS (
    SELECT g.*, row_number() OVER (PARTITION BY g.run_id ORDER BY g.cost, g.hypothesis_no) AS place
    FROM gathered AS g
),
criterion AS (
    SELECT b.run_id, b.hypothesis_no, b.found, b.believed, b.account_log_odds,
        greatest(max(CASE t.name WHEN 'rival_share' THEN t.value END) * b.found,
            max(CASE t.name WHEN 'min_margin' THEN t.value END)) AS margin,
        max(CASE t.name WHEN 'prior_odds' THEN t.value END) AS prior_odds,
        max(CASE t.name WHEN 'rival_odds' THEN t.value END) AS rival_odds
    FROM ranked AS b
    JOIN threshold AS t ON t.run_id = b.run_id AND t.decision = 'verdict'
    WHERE b.place = 1
    GROUP BY b.run_id, b.hypothesis_no, b.found, b.believed, b.account_log_odds
),
judged AS (
    SELECT r.run_id, r.hypothesis_no, r.found, r.distance, h.found - h.margin AS least,
        h.prior_odds, r.believed - h.believed AS odds, h.rival_odds, h.account_log_odds - r.account_log_odds AS behind,
        CASE
            WHEN r.hypothesis_no = 0 THEN 'best'
            WHEN r.is_symmetric THEN 'symmetric'
            WHEN r.hypothesis_no = h.hypothesis_no THEN 'rival'
            WHEN r.found <= h.found - h.margin THEN 'less_evidence'
            WHEN r.believed - h.believed >= h.prior_odds THEN 'far_from_prior'
            WHEN h.account_log_odds - r.account_log_odds >= h.rival_odds THEN 'account'
            ELSE 'rival'
        END AS rule
    FROM ranked AS r
    JOIN criterion AS h ON h.run_id = r.run_id
)
SELECT run_id, hypothesis_no, rule, found, least, distance,
    concat('pose ', hypothesis_no, ' gathers evidence of ', CAST(found AS NUMERIC(18, 1)),
        CASE WHEN distance IS NULL THEN ''
            ELSE concat(' and lies ', CAST(distance AS NUMERIC(18, 2)), ' sigma from the prior') END,
        ': ',
        CASE rule
            WHEN 'best' THEN 'it is the best'
            WHEN 'rival' THEN 'it explains as much: a rival, if it lies farther off than is needed'
            WHEN 'symmetric' THEN 'the symmetric model looks from there as from the best'
            WHEN 'less_evidence' THEN concat('dropped, for more than ', CAST(least AS NUMERIC(18, 1)),
                ' are needed to rival the likeliest')
            WHEN 'account' THEN concat('dropped, for the account of edges speaks against it by ', CAST(behind AS NUMERIC(18, 1)),
                ' log odds, and ', CAST(rival_odds AS NUMERIC(18, 1)), ' are allowed')
            ELSE concat('dropped, for the prior speaks against it by ', CAST(odds AS NUMERIC(18, 1)),
                ' log odds, and ', CAST(prior_odds AS NUMERIC(18, 1)), ' are allowed')
        END) AS sentence
FROM judged;

CREATE VIEW why_part (  -- localisation: Why a part or feature is said to be in view.
    run_id,  -- the run
    in_view_no,  -- ordinal in part_in_view
    path,  -- path of the part or feature
    level,  -- part or feature
    visible_share,  -- share that shows of what would show were nothing before it
    predicted,  -- model arcs of the part that views predict; 0 for features
    found,  -- of those, how many are likelier there than not
    sentence  -- the decision in words
) AS
SELECT p.run_id, p.in_view_no, p.path, p.level, p.visible_pixels / p.covered_pixels AS visible_share,
    coalesce(a.predicted, 0) AS predicted, coalesce(a.found, 0) AS found,
    concat(p.path, ' (', p.level, ') is in view: ', CAST(p.visible_pixels AS NUMERIC(18, 0)), ' px of it show, ',
        CAST(100 * p.visible_pixels / p.covered_pixels AS NUMERIC(18, 1)), ' percent of what would show were nothing before it',
        CASE WHEN p.level = 'part' THEN concat('; ', coalesce(a.found, 0), ' of the ', coalesce(a.predicted, 0),
            ' edges and outlines of it in the pictures are found') ELSE '' END) AS sentence
FROM part_in_view AS p
LEFT JOIN (
    SELECT run_id, occurrence_id, count(*) AS predicted,
        sum(CASE WHEN log_odds > 0 THEN 1 ELSE 0 END) AS found
    FROM view_arc
    GROUP BY run_id, occurrence_id
) AS a ON a.run_id = p.run_id AND a.occurrence_id = p.occurrence_id AND p.level = 'part';
