-- What decisions were held against: thresholds as they were, the signs that a verdict weighed, and what a pose rests on.

CREATE TABLE threshold (
    run_id BIGINT NOT NULL,
    decision TEXT NOT NULL,
    name TEXT NOT NULL,
    value DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, decision, name)
);
COMMENT ON TABLE threshold IS 'The numbers that the decisions of a run were held against, as they were at the time.';
COMMENT ON COLUMN threshold.run_id IS 'the run';
COMMENT ON COLUMN threshold.decision IS 'what was decided: verdict, correspondence, stereo or presence';
COMMENT ON COLUMN threshold.name IS 'name of the parameter, after that of the stage where the decision has several, as states.least_log_odds; of several in one NAME[0], NAME[1], ...; needs_translation_mm and needs_rotation as the user needed them';
COMMENT ON COLUMN threshold.value IS 'its value, in the unit that the parameter has: px, mm, rad or none';

CREATE TABLE verdict_sign (
    run_id BIGINT NOT NULL,
    name TEXT NOT NULL,
    value DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, name)
);
COMMENT ON TABLE verdict_sign IS 'What the verdict of an inspection weighed, in full precision.';
COMMENT ON COLUMN verdict_sign.run_id IS 'the run';
COMMENT ON COLUMN verdict_sign.name IS 'evidence (log odds against chance), share (evidence found over expected), agreement (share of edges found that lie on the arcs), apart (sigmas between the cameras alone), prior_sigma (sigmas from the prior), sigma_mm and sigma_rad (of the pose, worst direction), rivals, excluded (components left out), log_odds and likely (that the model is there, by the pictures), and others that the posterior weighs';
COMMENT ON COLUMN verdict_sign.value IS 'its value';

CREATE TABLE hypothesis_support (
    run_id BIGINT NOT NULL,
    hypothesis_no INTEGER NOT NULL,
    camera TEXT NOT NULL,
    evidence DOUBLE PRECISION NOT NULL,
    found DOUBLE PRECISION NOT NULL,
    expected DOUBLE PRECISION NOT NULL,
    deviation DOUBLE PRECISION NOT NULL,
    length_px DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, hypothesis_no, camera)
);
COMMENT ON TABLE hypothesis_support IS 'What each camera''s picture says for a hypothesis.';
COMMENT ON COLUMN hypothesis_support.run_id IS 'the run';
COMMENT ON COLUMN hypothesis_support.hypothesis_no IS 'the hypothesis';
COMMENT ON COLUMN hypothesis_support.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN hypothesis_support.evidence IS 'log odds that the model is there, arcs that do not show allowed for';
COMMENT ON COLUMN hypothesis_support.found IS 'sum of the log odds of all places looked at';
COMMENT ON COLUMN hypothesis_support.expected IS 'what that sum would be at the right pose';
COMMENT ON COLUMN hypothesis_support.deviation IS 'its standard deviation there';
COMMENT ON COLUMN hypothesis_support.length_px IS 'length of the predicted arcs in view, px';

CREATE TABLE camera_unknown (
    run_id BIGINT NOT NULL,
    camera TEXT NOT NULL,
    name TEXT NOT NULL,
    value DOUBLE PRECISION NOT NULL,
    expected DOUBLE PRECISION NOT NULL,
    sigma DOUBLE PRECISION NOT NULL,
    considered DOUBLE PRECISION NOT NULL,
    before DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, camera, name)
);
COMMENT ON TABLE camera_unknown IS 'What was solved of each camera along with the pose.';
COMMENT ON COLUMN camera_unknown.run_id IS 'the run';
COMMENT ON COLUMN camera_unknown.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN camera_unknown.name IS 'response (px at a contrast of the whole range), centre_u, centre_v (px), focal (share), and place in the rig: x, y, z (mm), rx, ry, rz (rad)';
COMMENT ON COLUMN camera_unknown.value IS 'as solved';
COMMENT ON COLUMN camera_unknown.expected IS 'as expected before';
COMMENT ON COLUMN camera_unknown.sigma IS 'standard deviation before; 0: exact, and not solved';
COMMENT ON COLUMN camera_unknown.considered IS 'standard deviation of an error in it that all cameras share, which is not solved but which the covariance holds; 0: none';
COMMENT ON COLUMN camera_unknown.before IS 'what the last step of the refinement set out from';

CREATE TABLE camera_alone (
    run_id BIGINT NOT NULL,
    camera TEXT NOT NULL,
    m00 DOUBLE PRECISION NOT NULL,
    m01 DOUBLE PRECISION NOT NULL,
    m02 DOUBLE PRECISION NOT NULL,
    m03 DOUBLE PRECISION NOT NULL,
    m10 DOUBLE PRECISION NOT NULL,
    m11 DOUBLE PRECISION NOT NULL,
    m12 DOUBLE PRECISION NOT NULL,
    m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL,
    m21 DOUBLE PRECISION NOT NULL,
    m22 DOUBLE PRECISION NOT NULL,
    m23 DOUBLE PRECISION NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL,
    evidence DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, camera),
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);
COMMENT ON TABLE camera_alone IS 'The pose of the rig that each camera''s picture gives by itself, near the best hypothesis; of several cameras.';
COMMENT ON COLUMN camera_alone.run_id IS 'the run';
COMMENT ON COLUMN camera_alone.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN camera_alone.m00 IS 'world_from_rig: row 0, column 0 of the rotation';
COMMENT ON COLUMN camera_alone.m01 IS 'world_from_rig: row 0, column 1 of the rotation';
COMMENT ON COLUMN camera_alone.m02 IS 'world_from_rig: row 0, column 2 of the rotation';
COMMENT ON COLUMN camera_alone.m03 IS 'world_from_rig: row 0 of the translation, mm';
COMMENT ON COLUMN camera_alone.m10 IS 'world_from_rig: row 1, column 0 of the rotation';
COMMENT ON COLUMN camera_alone.m11 IS 'world_from_rig: row 1, column 1 of the rotation';
COMMENT ON COLUMN camera_alone.m12 IS 'world_from_rig: row 1, column 2 of the rotation';
COMMENT ON COLUMN camera_alone.m13 IS 'world_from_rig: row 1 of the translation, mm';
COMMENT ON COLUMN camera_alone.m20 IS 'world_from_rig: row 2, column 0 of the rotation';
COMMENT ON COLUMN camera_alone.m21 IS 'world_from_rig: row 2, column 1 of the rotation';
COMMENT ON COLUMN camera_alone.m22 IS 'world_from_rig: row 2, column 2 of the rotation';
COMMENT ON COLUMN camera_alone.m23 IS 'world_from_rig: row 2 of the translation, mm';
COMMENT ON COLUMN camera_alone.covariance IS '6x6 row-major, of a right perturbation in the rig''s frame: t mm, then r rad';
COMMENT ON COLUMN camera_alone.evidence IS 'log odds that the model is there by this camera';

CREATE TABLE refinement (
    run_id BIGINT PRIMARY KEY,
    m00 DOUBLE PRECISION NOT NULL,
    m01 DOUBLE PRECISION NOT NULL,
    m02 DOUBLE PRECISION NOT NULL,
    m03 DOUBLE PRECISION NOT NULL,
    m10 DOUBLE PRECISION NOT NULL,
    m11 DOUBLE PRECISION NOT NULL,
    m12 DOUBLE PRECISION NOT NULL,
    m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL,
    m21 DOUBLE PRECISION NOT NULL,
    m22 DOUBLE PRECISION NOT NULL,
    m23 DOUBLE PRECISION NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL,
    middle_x DOUBLE PRECISION NOT NULL,
    middle_y DOUBLE PRECISION NOT NULL,
    middle_z DOUBLE PRECISION NOT NULL,
    excluded INTEGER NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);
COMMENT ON TABLE refinement IS 'What the last step of the refinement of the best hypothesis set out from: the pose at which the pictures were looked at last.';
COMMENT ON COLUMN refinement.run_id IS 'the run';
COMMENT ON COLUMN refinement.m00 IS 'world_from_rig: row 0, column 0 of the rotation';
COMMENT ON COLUMN refinement.m01 IS 'world_from_rig: row 0, column 1 of the rotation';
COMMENT ON COLUMN refinement.m02 IS 'world_from_rig: row 0, column 2 of the rotation';
COMMENT ON COLUMN refinement.m03 IS 'world_from_rig: row 0 of the translation, mm';
COMMENT ON COLUMN refinement.m10 IS 'world_from_rig: row 1, column 0 of the rotation';
COMMENT ON COLUMN refinement.m11 IS 'world_from_rig: row 1, column 1 of the rotation';
COMMENT ON COLUMN refinement.m12 IS 'world_from_rig: row 1, column 2 of the rotation';
COMMENT ON COLUMN refinement.m13 IS 'world_from_rig: row 1 of the translation, mm';
COMMENT ON COLUMN refinement.m20 IS 'world_from_rig: row 2, column 0 of the rotation';
COMMENT ON COLUMN refinement.m21 IS 'world_from_rig: row 2, column 1 of the rotation';
COMMENT ON COLUMN refinement.m22 IS 'world_from_rig: row 2, column 2 of the rotation';
COMMENT ON COLUMN refinement.m23 IS 'world_from_rig: row 2 of the translation, mm';
COMMENT ON COLUMN refinement.covariance IS 'covariance of what was measured there, 6x6 row-major, of a right perturbation in the rig''s frame: t mm, then r rad; that of the pose joins the explanations to it';
COMMENT ON COLUMN refinement.middle_x IS 'x of the middle of what is seen, mm, in the rig''s frame: where the place is to be as exact as needed';
COMMENT ON COLUMN refinement.middle_y IS 'y of that, mm';
COMMENT ON COLUMN refinement.middle_z IS 'z of that, mm';
COMMENT ON COLUMN refinement.excluded IS 'how many components of the model were left out since they are not where the model says';

CREATE TABLE explanation (
    run_id BIGINT NOT NULL,
    explanation_no INTEGER NOT NULL,
    m00 DOUBLE PRECISION NOT NULL,
    m01 DOUBLE PRECISION NOT NULL,
    m02 DOUBLE PRECISION NOT NULL,
    m03 DOUBLE PRECISION NOT NULL,
    m10 DOUBLE PRECISION NOT NULL,
    m11 DOUBLE PRECISION NOT NULL,
    m12 DOUBLE PRECISION NOT NULL,
    m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL,
    m21 DOUBLE PRECISION NOT NULL,
    m22 DOUBLE PRECISION NOT NULL,
    m23 DOUBLE PRECISION NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL,
    log_odds DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, explanation_no),
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);
COMMENT ON TABLE explanation IS 'Poses near the best that explain the pictures by other components of the model being off their place; its covariance holds them.';
COMMENT ON COLUMN explanation.run_id IS 'the run';
COMMENT ON COLUMN explanation.explanation_no IS 'ordinal in the run, from 0';
COMMENT ON COLUMN explanation.m00 IS 'world_from_rig: row 0, column 0 of the rotation';
COMMENT ON COLUMN explanation.m01 IS 'world_from_rig: row 0, column 1 of the rotation';
COMMENT ON COLUMN explanation.m02 IS 'world_from_rig: row 0, column 2 of the rotation';
COMMENT ON COLUMN explanation.m03 IS 'world_from_rig: row 0 of the translation, mm';
COMMENT ON COLUMN explanation.m10 IS 'world_from_rig: row 1, column 0 of the rotation';
COMMENT ON COLUMN explanation.m11 IS 'world_from_rig: row 1, column 1 of the rotation';
COMMENT ON COLUMN explanation.m12 IS 'world_from_rig: row 1, column 2 of the rotation';
COMMENT ON COLUMN explanation.m13 IS 'world_from_rig: row 1 of the translation, mm';
COMMENT ON COLUMN explanation.m20 IS 'world_from_rig: row 2, column 0 of the rotation';
COMMENT ON COLUMN explanation.m21 IS 'world_from_rig: row 2, column 1 of the rotation';
COMMENT ON COLUMN explanation.m22 IS 'world_from_rig: row 2, column 2 of the rotation';
COMMENT ON COLUMN explanation.m23 IS 'world_from_rig: row 2 of the translation, mm';
COMMENT ON COLUMN explanation.covariance IS '6x6 row-major, of a right perturbation in the rig''s frame: t mm, then r rad';
COMMENT ON COLUMN explanation.log_odds IS 'natural logarithm of its odds against the best';

CREATE TABLE search_stage (
    run_id BIGINT NOT NULL,
    stage_no INTEGER NOT NULL,
    name TEXT NOT NULL,
    looked_at INTEGER NOT NULL,
    least DOUBLE PRECISION,
    median DOUBLE PRECISION,
    share_90 DOUBLE PRECISION,
    share_99 DOUBLE PRECISION,
    greatest DOUBLE PRECISION,
    PRIMARY KEY (run_id, stage_no)
);
COMMENT ON TABLE search_stage IS 'The stages of the search for the pose, and the scores of all poses that each looked at.';
COMMENT ON COLUMN search_stage.run_id IS 'the run';
COMMENT ON COLUMN search_stage.stage_no IS 'ordinal in the run, from 0';
COMMENT ON COLUMN search_stage.name IS 'scan (of the prior''s volume, on coarse evidence), climb (on finer), and shift 1 .. (of the best pose by what repeats in the model)';
COMMENT ON COLUMN search_stage.looked_at IS 'poses that it looked at';
COMMENT ON COLUMN search_stage.least IS 'least of their scores: evidence less half the squared distance from the prior; null where none was worked out';
COMMENT ON COLUMN search_stage.median IS 'median of their scores';
COMMENT ON COLUMN search_stage.share_90 IS 'score that 90 percent of them do not exceed';
COMMENT ON COLUMN search_stage.share_99 IS 'score that 99 percent of them do not exceed';
COMMENT ON COLUMN search_stage.greatest IS 'greatest of their scores';

CREATE TABLE search_pose (
    run_id BIGINT NOT NULL,
    stage_no INTEGER NOT NULL,
    pose_no INTEGER NOT NULL,
    m00 DOUBLE PRECISION NOT NULL,
    m01 DOUBLE PRECISION NOT NULL,
    m02 DOUBLE PRECISION NOT NULL,
    m03 DOUBLE PRECISION NOT NULL,
    m10 DOUBLE PRECISION NOT NULL,
    m11 DOUBLE PRECISION NOT NULL,
    m12 DOUBLE PRECISION NOT NULL,
    m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL,
    m21 DOUBLE PRECISION NOT NULL,
    m22 DOUBLE PRECISION NOT NULL,
    m23 DOUBLE PRECISION NOT NULL,
    score DOUBLE PRECISION,
    rule TEXT NOT NULL,
    PRIMARY KEY (run_id, stage_no, pose_no),
    CHECK (rule IN ('goes_on', 'refined', 'like_a_better_one', 'like_a_refined_one', 'little_evidence', 'nothing_in_view', 'beyond')),
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);
COMMENT ON TABLE search_pose IS 'The poses of the rig that left a stage of the search, and what became of each.';
COMMENT ON COLUMN search_pose.run_id IS 'the run';
COMMENT ON COLUMN search_pose.stage_no IS 'the stage';
COMMENT ON COLUMN search_pose.pose_no IS 'ordinal in the stage, from 0';
COMMENT ON COLUMN search_pose.m00 IS 'world_from_rig: row 0, column 0 of the rotation';
COMMENT ON COLUMN search_pose.m01 IS 'world_from_rig: row 0, column 1 of the rotation';
COMMENT ON COLUMN search_pose.m02 IS 'world_from_rig: row 0, column 2 of the rotation';
COMMENT ON COLUMN search_pose.m03 IS 'world_from_rig: row 0 of the translation, mm';
COMMENT ON COLUMN search_pose.m10 IS 'world_from_rig: row 1, column 0 of the rotation';
COMMENT ON COLUMN search_pose.m11 IS 'world_from_rig: row 1, column 1 of the rotation';
COMMENT ON COLUMN search_pose.m12 IS 'world_from_rig: row 1, column 2 of the rotation';
COMMENT ON COLUMN search_pose.m13 IS 'world_from_rig: row 1 of the translation, mm';
COMMENT ON COLUMN search_pose.m20 IS 'world_from_rig: row 2, column 0 of the rotation';
COMMENT ON COLUMN search_pose.m21 IS 'world_from_rig: row 2, column 1 of the rotation';
COMMENT ON COLUMN search_pose.m22 IS 'world_from_rig: row 2, column 2 of the rotation';
COMMENT ON COLUMN search_pose.m23 IS 'world_from_rig: row 2 of the translation, mm';
COMMENT ON COLUMN search_pose.score IS 'its score, as in search_stage; null where none was worked out';
COMMENT ON COLUMN search_pose.rule IS 'goes_on (to the next stage), refined, or why dropped: like_a_better_one or like_a_refined_one (shows the same), little_evidence (against the best), nothing_in_view, beyond (more than are followed up)';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('threshold', 'run', 'primary'),
    ('verdict_sign', 'localisation', 'primary'),
    ('hypothesis_support', 'localisation', 'primary'),
    ('camera_unknown', 'localisation', 'primary'),
    ('camera_alone', 'localisation', 'primary'),
    ('refinement', 'localisation', 'primary'),
    ('search_stage', 'localisation', 'primary'),
    ('search_pose', 'localisation', 'primary'),
    ('explanation', 'localisation', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('threshold', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('verdict_sign', 0, ARRAY['run_id'], 'pose', ARRAY['run_id']),
    ('hypothesis_support', 0, ARRAY['run_id', 'hypothesis_no'], 'hypothesis', ARRAY['run_id', 'hypothesis_no']),
    ('camera_unknown', 0, ARRAY['run_id'], 'pose', ARRAY['run_id']),
    ('camera_alone', 0, ARRAY['run_id'], 'pose', ARRAY['run_id']),
    ('refinement', 0, ARRAY['run_id'], 'pose', ARRAY['run_id']),
    ('search_stage', 0, ARRAY['run_id'], 'pose', ARRAY['run_id']),
    ('search_pose', 0, ARRAY['run_id', 'stage_no'], 'search_stage', ARRAY['run_id', 'stage_no']),
    ('explanation', 0, ARRAY['run_id'], 'pose', ARRAY['run_id']);
