-- Relational matching: units with relations on both sides, what could match what, and what was decided.

CREATE TABLE view (
    run_id BIGINT NOT NULL,
    view_no INTEGER NOT NULL,
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
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (run_id, view_no)
);
COMMENT ON TABLE view IS 'The view of the model that was predicted for one camera at one pose of a run.';
COMMENT ON COLUMN view.run_id IS 'the run';
COMMENT ON COLUMN view.view_no IS 'ordinal in the run, from 0';
COMMENT ON COLUMN view.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN view.m00 IS 'world_from_camera: row 0, column 0 of the rotation';
COMMENT ON COLUMN view.m01 IS 'world_from_camera: row 0, column 1 of the rotation';
COMMENT ON COLUMN view.m02 IS 'world_from_camera: row 0, column 2 of the rotation';
COMMENT ON COLUMN view.m03 IS 'world_from_camera: row 0 of the translation, mm';
COMMENT ON COLUMN view.m10 IS 'world_from_camera: row 1, column 0 of the rotation';
COMMENT ON COLUMN view.m11 IS 'world_from_camera: row 1, column 1 of the rotation';
COMMENT ON COLUMN view.m12 IS 'world_from_camera: row 1, column 2 of the rotation';
COMMENT ON COLUMN view.m13 IS 'world_from_camera: row 1 of the translation, mm';
COMMENT ON COLUMN view.m20 IS 'world_from_camera: row 2, column 0 of the rotation';
COMMENT ON COLUMN view.m21 IS 'world_from_camera: row 2, column 1 of the rotation';
COMMENT ON COLUMN view.m22 IS 'world_from_camera: row 2, column 2 of the rotation';
COMMENT ON COLUMN view.m23 IS 'world_from_camera: row 2 of the translation, mm';

CREATE SEQUENCE unit_set_id_seq;
CREATE TABLE unit_set (
    id BIGINT PRIMARY KEY,
    kind TEXT NOT NULL,
    extraction_id BIGINT,
    run_id BIGINT,
    view_no INTEGER,
    CHECK (kind IN ('extraction', 'view')),
    CHECK ((kind = 'extraction') = (extraction_id IS NOT NULL)),
    CHECK ((kind = 'view') = (run_id IS NOT NULL AND view_no IS NOT NULL))
);
COMMENT ON TABLE unit_set IS 'A set of primitives that a matcher sees: of one image.';
COMMENT ON COLUMN unit_set.id IS 'identity of the set';
COMMENT ON COLUMN unit_set.kind IS 'extraction: arcs, then regions of a picture; view: arcs, then surfaces that a camera should see at a pose';
COMMENT ON COLUMN unit_set.extraction_id IS 'the extraction whose arcs and regions they are; null of a view';
COMMENT ON COLUMN unit_set.run_id IS 'the run that predicted the view; null of an extraction';
COMMENT ON COLUMN unit_set.view_no IS 'the view of that run; null of an extraction';

-- Without keys, as the arcs and regions of images.
CREATE TABLE unit (
    unit_set_id BIGINT NOT NULL,
    unit_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    ref_no INTEGER NOT NULL,
    CHECK (kind IN ('arc', 'region', 'view_arc', 'view_surface'))
);
COMMENT ON TABLE unit IS 'A primitive as a matcher sees it.';
COMMENT ON COLUMN unit.unit_set_id IS 'the set';
COMMENT ON COLUMN unit.unit_no IS 'ordinal in the set, from 0';
COMMENT ON COLUMN unit.kind IS 'arc, region, view_arc or view_surface';
COMMENT ON COLUMN unit.ref_no IS 'image_arc_no, region_no, view_arc_no or view_surface_no of what it stands for';

-- Without keys, as the units: some 6,000 rows a picture.
CREATE TABLE unit_relation (
    unit_set_id BIGINT NOT NULL,
    kind TEXT NOT NULL,
    unit_a INTEGER NOT NULL,
    unit_b INTEGER NOT NULL,
    distance REAL NOT NULL,
    distance_sigma REAL NOT NULL,
    angle REAL NOT NULL,
    angle_sigma REAL NOT NULL
);
COMMENT ON TABLE unit_relation IS 'Relations of two units, each a distance and an angle, stored with their inverse but for surrounds.';
COMMENT ON COLUMN unit_relation.unit_set_id IS 'the set';
COMMENT ON COLUMN unit_relation.kind IS 'near, parallel, perpendicular, junction (an end of one at the other), concentric, equal_radius, bounds, adjacent, surrounds (a is the outer one)';
COMMENT ON COLUMN unit_relation.unit_a IS 'one unit';
COMMENT ON COLUMN unit_relation.unit_b IS 'the other';
COMMENT ON COLUMN unit_relation.distance IS 'px: least gap of near, perpendicular, junction; offset of the middle of b to the left of the line of a of parallel; between the centres of concentric; radius of b less that of a of equal_radius; length of the common border of bounds, adjacent, surrounds';
COMMENT ON COLUMN unit_relation.distance_sigma IS 'standard deviation of the distance, px';
COMMENT ON COLUMN unit_relation.angle IS 'rad: bearing of the middle of b from that of a, from x towards y, of near, bounds, adjacent, surrounds (above -pi, at most pi); between the two of parallel, perpendicular, junction (0 to pi/2); 0 of concentric, equal_radius';
COMMENT ON COLUMN unit_relation.angle_sigma IS 'standard deviation of the angle, rad; 0 where the kind has none';

CREATE TABLE problem (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    method TEXT NOT NULL,
    units_id BIGINT NOT NULL,
    labels_id BIGINT NOT NULL,
    parameters JSON NOT NULL,
    injective BOOLEAN NOT NULL,
    dual_scale INTEGER,
    status TEXT NOT NULL,
    cost DOUBLE PRECISION NOT NULL,
    bound DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, problem_no),
    CHECK (kind IN ('stereo', 'localisation')),
    CHECK (status IN ('optimal', 'bounded', 'stopped'))
);
COMMENT ON TABLE problem IS 'One matching problem of a run: units to be given labels, and how it ended.';
COMMENT ON COLUMN problem.run_id IS 'the run';
COMMENT ON COLUMN problem.problem_no IS 'ordinal in the run, from 0';
COMMENT ON COLUMN problem.kind IS 'stereo or localisation';
COMMENT ON COLUMN problem.method IS 'method that solved it';
COMMENT ON COLUMN problem.units_id IS 'units that get labels';
COMMENT ON COLUMN problem.labels_id IS 'labels that they get';
COMMENT ON COLUMN problem.parameters IS 'parameters of the method, defaults included';
COMMENT ON COLUMN problem.injective IS 'whether no label may be taken twice';
COMMENT ON COLUMN problem.dual_scale IS 'duals are costs times this, and costs are integers, so bounds are rounded up; null where costs are real and duals as they are';
COMMENT ON COLUMN problem.status IS 'optimal (the stored proof meets the cost), bounded or stopped';
COMMENT ON COLUMN problem.cost IS 'cost of the assignment found';
COMMENT ON COLUMN problem.bound IS 'proved lower bound of the cost';

CREATE TABLE candidate (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    unit_no INTEGER NOT NULL,
    label_no INTEGER NOT NULL,
    cost DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, problem_no, unit_no, label_no)
);
COMMENT ON TABLE candidate IS 'Pairs of unit and label that passed the gate, with the cost of each by itself.';
COMMENT ON COLUMN candidate.run_id IS 'the run';
COMMENT ON COLUMN candidate.problem_no IS 'the problem';
COMMENT ON COLUMN candidate.unit_no IS 'the unit';
COMMENT ON COLUMN candidate.label_no IS 'the label';
COMMENT ON COLUMN candidate.cost IS 'unary cost of the pair';

CREATE TABLE problem_tolerance (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    distance DOUBLE PRECISION NOT NULL,
    distance_share DOUBLE PRECISION NOT NULL,
    angle DOUBLE PRECISION NOT NULL,
    reach DOUBLE PRECISION NOT NULL,
    weight INTEGER NOT NULL,
    PRIMARY KEY (run_id, problem_no, kind)
);
COMMENT ON TABLE problem_tolerance IS 'How far a relation of labels may differ from that of the units which it confirms, and what a relation weighs.';
COMMENT ON COLUMN problem_tolerance.run_id IS 'the run';
COMMENT ON COLUMN problem_tolerance.problem_no IS 'the problem';
COMMENT ON COLUMN problem_tolerance.kind IS 'kind of relation, as in unit_relation; kinds that are not listed count for nothing';
COMMENT ON COLUMN problem_tolerance.distance IS 'greatest difference of the distances, px, besides the share';
COMMENT ON COLUMN problem_tolerance.distance_share IS 'greatest difference of the distances as a share of that of the units, added to it';
COMMENT ON COLUMN problem_tolerance.angle IS 'greatest difference of the angles, rad';
COMMENT ON COLUMN problem_tolerance.reach IS 'greatest distance at which a relation of units asks to be confirmed, px; relations of labels confirm at any';
COMMENT ON COLUMN problem_tolerance.weight IS 'what a relation of the kind costs where it is not confirmed';

-- Without keys, as the compatibilities and duals: many rows, and queries/check finds what is there twice.
CREATE TABLE problem_relation (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    unit_no INTEGER NOT NULL,
    neighbour_no INTEGER NOT NULL,
    weight INTEGER NOT NULL,
    CHECK (unit_no <> neighbour_no AND weight >= 0)
);
COMMENT ON TABLE problem_relation IS 'Neighbours of a unit in a problem, and what it costs when one does not confirm its label.';
COMMENT ON COLUMN problem_relation.run_id IS 'the run';
COMMENT ON COLUMN problem_relation.problem_no IS 'the problem';
COMMENT ON COLUMN problem_relation.unit_no IS 'the unit that pays';
COMMENT ON COLUMN problem_relation.neighbour_no IS 'the unit whose label confirms or does not';
COMMENT ON COLUMN problem_relation.weight IS 'what the unit pays, if it has a label, where that does not';

CREATE TABLE compatibility (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    unit_a INTEGER NOT NULL,
    label_a INTEGER NOT NULL,
    unit_b INTEGER NOT NULL,
    label_b INTEGER NOT NULL,
    CHECK (unit_a < unit_b)
);
COMMENT ON TABLE compatibility IS 'Pairs of candidates that confirm each other, stored once.';
COMMENT ON COLUMN compatibility.run_id IS 'the run';
COMMENT ON COLUMN compatibility.problem_no IS 'the problem';
COMMENT ON COLUMN compatibility.unit_a IS 'the unit of lower number';
COMMENT ON COLUMN compatibility.label_a IS 'its label';
COMMENT ON COLUMN compatibility.unit_b IS 'the other unit';
COMMENT ON COLUMN compatibility.label_b IS 'its label';

CREATE TABLE vote (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    unit_no INTEGER NOT NULL,
    label_no INTEGER NOT NULL,
    votes INTEGER NOT NULL,
    overlap INTEGER NOT NULL,
    disparity DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, problem_no, unit_no, label_no)
);
COMMENT ON TABLE vote IS 'Votes of epipolar rows for pairs of arcs in stereo.';
COMMENT ON COLUMN vote.run_id IS 'the run';
COMMENT ON COLUMN vote.problem_no IS 'the problem';
COMMENT ON COLUMN vote.unit_no IS 'unit of the left image';
COMMENT ON COLUMN vote.label_no IS 'unit of the right image';
COMMENT ON COLUMN vote.votes IS 'rows in which they were matched';
COMMENT ON COLUMN vote.overlap IS 'rows that both cross';
COMMENT ON COLUMN vote.disparity IS 'mean disparity over the votes, px of the rectified images';

CREATE TABLE assignment (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    unit_no INTEGER NOT NULL,
    label_no INTEGER,
    cost DOUBLE PRECISION NOT NULL,
    null_cost DOUBLE PRECISION NOT NULL,
    reason TEXT NOT NULL,
    PRIMARY KEY (run_id, problem_no, unit_no),
    CHECK ((label_no IS NOT NULL) = (reason = 'matched'))
);
COMMENT ON TABLE assignment IS 'What the matcher decided for each unit.';
COMMENT ON COLUMN assignment.run_id IS 'the run';
COMMENT ON COLUMN assignment.problem_no IS 'the problem';
COMMENT ON COLUMN assignment.unit_no IS 'the unit';
COMMENT ON COLUMN assignment.label_no IS 'its label; null where it has none';
COMMENT ON COLUMN assignment.cost IS 'what this decision costs';
COMMENT ON COLUMN assignment.null_cost IS 'what it costs to leave the unit without a label';
COMMENT ON COLUMN assignment.reason IS 'matched, or why not: no_candidate, null_cheaper, taken';

CREATE TABLE assignment_error (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    unit_no INTEGER NOT NULL,
    neighbour_no INTEGER NOT NULL,
    PRIMARY KEY (run_id, problem_no, unit_no, neighbour_no)
);
COMMENT ON TABLE assignment_error IS 'Relations that an assignment leaves unconfirmed.';
COMMENT ON COLUMN assignment_error.run_id IS 'the run';
COMMENT ON COLUMN assignment_error.problem_no IS 'the problem';
COMMENT ON COLUMN assignment_error.unit_no IS 'the unit';
COMMENT ON COLUMN assignment_error.neighbour_no IS 'related unit that does not confirm it';

CREATE TABLE search_node (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    node_no INTEGER NOT NULL,
    parent_no INTEGER,
    proof_no INTEGER NOT NULL,
    depth INTEGER NOT NULL,
    branch TEXT NOT NULL,
    unit_no INTEGER,
    label_no INTEGER,
    bound DOUBLE PRECISION NOT NULL,
    status TEXT NOT NULL,
    PRIMARY KEY (run_id, problem_no, node_no),
    CHECK (branch IN ('root', 'take', 'rest')),
    CHECK ((parent_no IS NULL) = (branch = 'root')),
    CHECK ((unit_no IS NOT NULL) = (branch = 'take')),
    CHECK (status IN ('branched', 'pruned', 'open'))
);
COMMENT ON TABLE search_node IS 'Sets of labellings that a search split a problem into, each with a lower bound of what they cost.';
COMMENT ON COLUMN search_node.run_id IS 'the run';
COMMENT ON COLUMN search_node.problem_no IS 'the problem';
COMMENT ON COLUMN search_node.node_no IS 'ordinal in the search, from 0, the root';
COMMENT ON COLUMN search_node.parent_no IS 'node that it is part of';
COMMENT ON COLUMN search_node.proof_no IS 'node whose duals bound it: itself or its parent';
COMMENT ON COLUMN search_node.depth IS 'depth in the tree';
COMMENT ON COLUMN search_node.branch IS 'root: all labellings; take: those of the parent in which the unit has the label; rest: those that are in no take of the parent';
COMMENT ON COLUMN search_node.unit_no IS 'unit that takes a label';
COMMENT ON COLUMN search_node.label_no IS 'the label; null for none';
COMMENT ON COLUMN search_node.bound IS 'no labelling of the node costs less, or none costs less than the one found';
COMMENT ON COLUMN search_node.status IS 'branched (its children are what it holds), pruned or open';

CREATE TABLE bound_price (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    node_no INTEGER NOT NULL,
    label_no INTEGER NOT NULL,
    dual DOUBLE PRECISION NOT NULL
);
COMMENT ON TABLE bound_price IS 'Certificate of a bound: dual values of labels; 0 where there is no row.';
COMMENT ON COLUMN bound_price.run_id IS 'the run';
COMMENT ON COLUMN bound_price.problem_no IS 'the problem';
COMMENT ON COLUMN bound_price.node_no IS 'the node of the search that it bounds';
COMMENT ON COLUMN bound_price.label_no IS 'the label';
COMMENT ON COLUMN bound_price.dual IS 'its dual value, at most 0: what every unit that takes it pays on top';

CREATE TABLE bound_message (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    node_no INTEGER NOT NULL,
    unit_no INTEGER NOT NULL,
    label_no INTEGER NOT NULL,
    neighbour_no INTEGER NOT NULL,
    dual DOUBLE PRECISION NOT NULL
);
COMMENT ON TABLE bound_message IS 'Certificate of a bound: dual values of a unit''s label and a neighbour; 0 where there is no row.';
COMMENT ON COLUMN bound_message.run_id IS 'the run';
COMMENT ON COLUMN bound_message.problem_no IS 'the problem';
COMMENT ON COLUMN bound_message.node_no IS 'the node of the search that it bounds';
COMMENT ON COLUMN bound_message.unit_no IS 'the unit';
COMMENT ON COLUMN bound_message.label_no IS 'its label';
COMMENT ON COLUMN bound_message.neighbour_no IS 'the neighbour';
COMMENT ON COLUMN bound_message.dual IS 'the share, at least 0, of what the two save when they confirm each other that is credited to this unit';

CREATE TABLE triangulated_unit (
    run_id BIGINT NOT NULL,
    problem_no INTEGER NOT NULL,
    unit_no INTEGER NOT NULL,
    curve TEXT NOT NULL,
    start_x DOUBLE PRECISION NOT NULL,
    start_y DOUBLE PRECISION NOT NULL,
    start_z DOUBLE PRECISION NOT NULL,
    end_x DOUBLE PRECISION NOT NULL,
    end_y DOUBLE PRECISION NOT NULL,
    end_z DOUBLE PRECISION NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL,
    centre_x DOUBLE PRECISION,
    centre_y DOUBLE PRECISION,
    centre_z DOUBLE PRECISION,
    major_x DOUBLE PRECISION,
    major_y DOUBLE PRECISION,
    major_z DOUBLE PRECISION,
    minor_x DOUBLE PRECISION,
    minor_y DOUBLE PRECISION,
    minor_z DOUBLE PRECISION,
    PRIMARY KEY (run_id, problem_no, unit_no),
    CHECK (curve IN ('line', 'circle', 'ellipse', 'free')),
    CHECK (covariance[36] IS NOT NULL AND covariance[37] IS NULL AND covariance[1] > 0 AND covariance[22] > 0),
    CHECK ((centre_x IS NOT NULL) = (curve IN ('circle', 'ellipse')))
);
COMMENT ON TABLE triangulated_unit IS 'Stereo matches in space: matched arcs as curves in the frame of the rig, with both ends.';
COMMENT ON COLUMN triangulated_unit.run_id IS 'the run';
COMMENT ON COLUMN triangulated_unit.problem_no IS 'the problem';
COMMENT ON COLUMN triangulated_unit.unit_no IS 'the unit of the left image';
COMMENT ON COLUMN triangulated_unit.curve IS 'line, circle, ellipse (centre + cos t major + sin t minor) or free';
COMMENT ON COLUMN triangulated_unit.start_x IS 'x of the first end of the part that both images show, in the walk of the left arc, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.start_y IS 'y of the first end of the part that both images show, in the walk of the left arc, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.start_z IS 'z of the first end of the part that both images show, in the walk of the left arc, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.end_x IS 'x of the last end of that part, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.end_y IS 'y of the last end of that part, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.end_z IS 'z of the last end of that part, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.covariance IS 'covariance of start and end, 6x6 row by row, mm^2, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.centre_x IS 'x of the centre of a circle or ellipse, mm, in the rig''s frame; null for other curves';
COMMENT ON COLUMN triangulated_unit.centre_y IS 'y of the centre of a circle or ellipse, mm, in the rig''s frame; null for other curves';
COMMENT ON COLUMN triangulated_unit.centre_z IS 'z of the centre of a circle or ellipse, mm, in the rig''s frame; null for other curves';
COMMENT ON COLUMN triangulated_unit.major_x IS 'x of the major semi-axis, mm, in the rig''s frame; of a circle, any radius';
COMMENT ON COLUMN triangulated_unit.major_y IS 'y of the major semi-axis, mm, in the rig''s frame; of a circle, any radius';
COMMENT ON COLUMN triangulated_unit.major_z IS 'z of the major semi-axis, mm, in the rig''s frame; of a circle, any radius';
COMMENT ON COLUMN triangulated_unit.minor_x IS 'x of the minor semi-axis, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.minor_y IS 'y of the minor semi-axis, mm, in the rig''s frame';
COMMENT ON COLUMN triangulated_unit.minor_z IS 'z of the minor semi-axis, mm, in the rig''s frame';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('view', 'matching', 'primary'),
    ('unit_set', 'matching', 'primary'),
    ('unit', 'matching', 'primary'),
    ('unit_relation', 'matching', 'primary'),
    ('problem', 'matching', 'primary'),
    ('candidate', 'matching', 'primary'),
    ('problem_tolerance', 'matching', 'primary'),
    ('problem_relation', 'matching', 'primary'),
    ('compatibility', 'matching', 'redundant'),
    ('vote', 'matching', 'primary'),
    ('assignment', 'matching', 'primary'),
    ('assignment_error', 'matching', 'redundant'),
    ('search_node', 'matching', 'primary'),
    ('bound_price', 'matching', 'primary'),
    ('bound_message', 'matching', 'primary'),
    ('triangulated_unit', 'matching', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('view', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('unit_set', 0, ARRAY['extraction_id'], 'extraction', ARRAY['id']),
    ('unit_set', 1, ARRAY['run_id', 'view_no'], 'view', ARRAY['run_id', 'view_no']),
    ('problem', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('problem', 1, ARRAY['units_id'], 'unit_set', ARRAY['id']),
    ('problem', 2, ARRAY['labels_id'], 'unit_set', ARRAY['id']),
    ('candidate', 0, ARRAY['run_id', 'problem_no'], 'problem', ARRAY['run_id', 'problem_no']),
    ('problem_tolerance', 0, ARRAY['run_id', 'problem_no'], 'problem', ARRAY['run_id', 'problem_no']),
    ('compatibility', 0, ARRAY['run_id', 'problem_no'], 'problem', ARRAY['run_id', 'problem_no']),
    ('vote', 0, ARRAY['run_id', 'problem_no'], 'problem', ARRAY['run_id', 'problem_no']),
    ('assignment', 0, ARRAY['run_id', 'problem_no'], 'problem', ARRAY['run_id', 'problem_no']),
    ('assignment_error', 0, ARRAY['run_id', 'problem_no', 'unit_no'], 'assignment', ARRAY['run_id', 'problem_no', 'unit_no']),
    ('search_node', 0, ARRAY['run_id', 'problem_no'], 'problem', ARRAY['run_id', 'problem_no']),
    ('triangulated_unit', 0, ARRAY['run_id', 'problem_no', 'unit_no'], 'assignment', ARRAY['run_id', 'problem_no', 'unit_no']);
