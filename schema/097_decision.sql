-- What decisions were compared with: thresholds as they were, the statistics that a verdict weighed, and what a pose rests on.

CREATE TABLE threshold (  -- run: The numbers that the decisions of a run were compared with, as they were at the time.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run
    decision TEXT NOT NULL,  -- what was decided: verdict, correspondence, stereo, presence or picture
    name TEXT NOT NULL,  -- name of the parameter, after that of the stage where the decision has several, as states.least_log_odds; of several in one
        -- NAME[0], NAME[1], ...; needs_translation_mm and needs_rotation as the user needed them
    value DOUBLE PRECISION NOT NULL,  -- its value, in the unit that the parameter has: px, mm, rad or none
    PRIMARY KEY (run_id, decision, name)
);

CREATE TABLE verdict_statistic (  -- localisation: What the verdict of an inspection weighed, in full precision.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    name TEXT NOT NULL,  -- evidence (log odds of edges and outlines), chance_level and chance_scale (of poses elsewhere in the pictures one in
        -- exp((evidence - level) / scale) gathers as much), rarity (that exponent), share (evidence found over expected), agreement (share of edges
        -- found that lie on the arcs), apart (sigmas between the single cameras), prior_sigma (sigmas from the prior), prior_mm
        -- (how far the rig is from it; only where the pose was found without it, for it contradicts the pictures), prior_left_out (1 where the pictures were
        -- to be believed then, else 0), sigma_mm and sigma_rad (of the pose, worst
        -- direction), rivals, excluded (placed parts left out), log_odds and likely (that the model is there, by the pictures), of each of several
        -- cameras by its name, as of left: sees left (log odds that it sees the model), agreement left, chance_level left and
        -- chance_scale left; absent (log odds that edges of the model are not there which should show, beside what has moved or is told missing),
        -- absent_anywhere (of all, with no prior), rival_face_mm (how far a face lies from its place that may hold the pose instead of others), features (log odds that features, as they are told, are another object's), faces_off (standard deviations, rms, by which the faces that hold the pose lie off, but the farthest); and others that the posterior weighs
    value DOUBLE PRECISION NOT NULL,  -- its value
    PRIMARY KEY (run_id, name)
);

CREATE TABLE hypothesis_support (  -- localisation: What each camera's picture says for a hypothesis.
    run_id BIGINT NOT NULL,  -- the run
    hypothesis_no INTEGER NOT NULL,  -- REFERENCES hypothesis (run_id, hypothesis_no): the hypothesis
    camera TEXT NOT NULL,  -- name of the camera in the rig
    evidence DOUBLE PRECISION NOT NULL,  -- log odds that the model is there, arcs that do not show allowed for
    found DOUBLE PRECISION NOT NULL,  -- sum of the log odds of all places looked at
    expected DOUBLE PRECISION NOT NULL,  -- what that sum would be at the right pose
    length_px DOUBLE PRECISION NOT NULL,  -- length of the predicted arcs in view, px
    PRIMARY KEY (run_id, hypothesis_no, camera)
);

CREATE TABLE camera_unknown (  -- localisation: What was solved of each camera along with the pose.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    camera TEXT NOT NULL,  -- name of the camera in the rig
    name TEXT NOT NULL,  -- response (px at a contrast of the whole range), centre_u, centre_v (px), focal (share), and place in the rig: x, y, z
        -- (mm), rx, ry, rz (rad), and radial, what is added to the first coefficient of distortion
    value DOUBLE PRECISION NOT NULL,  -- as the pictures show it, the file all but left out; of the place in the rig as the pose has it
    expected DOUBLE PRECISION NOT NULL,  -- as expected before
    sigma DOUBLE PRECISION NOT NULL,  -- standard deviation before; 0: exact, and not solved
    sigma_shown DOUBLE PRECISION NOT NULL,  -- standard deviation of what the pictures show of it, where the file errs as stated and edges as they do
    PRIMARY KEY (run_id, camera, name)
);

CREATE TABLE standpoint (  -- localisation: The standpoints of rigs whose pictures an inspection took together, their cameras named STANDPOINT/CAMERA.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    standpoint_no INTEGER NOT NULL,  -- ordinal in the run, from 0; the frame of the inspection's rig is that of the first that is not ignored
    name TEXT NOT NULL,  -- its name
    rig_id BIGINT NOT NULL,  -- REFERENCES rig (id): the rig that stood there
    carrier TEXT,  -- name of the object that carried it; null where the world does not mount it
    ignored BOOLEAN NOT NULL,  -- whether its pictures were left out
    joints JSON NOT NULL,  -- values of the joints (rad, mm) that said where it is, by name
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_rig as stated
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL,  -- 6x6 row-major, as stated, of a right perturbation in the rig's frame: t mm, then r rad
    sway DOUBLE PRECISION[] NOT NULL,  -- 6x6 row-major: that perturbation, by a standard deviation of each number of where the base of its carrier stands
    moved DOUBLE PRECISION[],  -- that perturbation (6) as solved; this and the next two are null where it has no picture or no pose was found
    covariance_left DOUBLE PRECISION[],  -- what pictures and the other standpoints leave open of it, as covariance
    sigmas DOUBLE PRECISION,  -- by how many standard deviations they contradict it, of one number that is as improbable
    PRIMARY KEY (run_id, standpoint_no),
    UNIQUE (run_id, name)
);

CREATE TABLE solved_pose (  -- localisation: Poses of the rig that go with the best hypothesis: where its last step set out, what each camera's picture gives by
    -- itself, what explains the pictures by other placed parts being off their place, and those from which a symmetric model
    -- looks the same.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    solved_no INTEGER NOT NULL,  -- ordinal in the run, from 0
    kind TEXT NOT NULL,  -- start: the pose at which the pictures were looked at last; single_camera: that of one camera; explanation;
        -- equivalent: by a symmetry of the model
    camera TEXT,  -- name of the camera in the rig of a single_camera pose; null of other kinds
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_rig
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL,  -- 6x6 row-major, of a right perturbation in the rig's frame: t mm, then r rad; at the start of what was
        -- measured there, to which that of the pose joins the explanations
    log_odds DOUBLE PRECISION,  -- natural logarithm: that the model is there by this camera; of others against the best; null at the start
    PRIMARY KEY (run_id, solved_no),
    CHECK (kind IN ('start', 'single_camera', 'explanation', 'equivalent')),
    CHECK ((kind = 'single_camera') = (camera IS NOT NULL)),
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);

CREATE TABLE search_pose (  -- localisation: The poses of the rig that left a stage of the search, and what became of each.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    stage_no INTEGER NOT NULL,  -- ordinal of the stage in the run, from 0
    pose_no INTEGER NOT NULL,  -- ordinal in the stage, from 0
    stage TEXT NOT NULL,  -- join (of circles), lines (a join of straight edges where circles explain too little), about (drawn about the best where few
        -- edges hold it), scan (of the prior's volume, on coarse evidence), climb (on finer), and shift 1 .. (of the best pose by what repeats in the model)
    looked_at INTEGER NOT NULL,  -- poses that the stage looked at
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_rig
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    score DOUBLE PRECISION,  -- its score: evidence less half the squared distance from the prior; of a join the share of what stereo puts
        -- in space that lies on the model, of one picture the log odds of its ellipses; null where none was worked out
    rule TEXT NOT NULL,  -- goes_on (to the next stage), refined, or why dropped: like_a_better_one or like_a_refined_one (shows the same),
        -- little_evidence (against the best), nothing_in_view, beyond (more than are followed up)
    PRIMARY KEY (run_id, stage_no, pose_no),
    CHECK (rule IN ('goes_on', 'refined', 'like_a_better_one', 'like_a_refined_one', 'little_evidence', 'nothing_in_view', 'beyond')),
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);
