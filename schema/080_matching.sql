-- Relational matching: units with relations on both sides, what could match what, and what was decided.

CREATE SEQUENCE unit_set_id_seq;
CREATE TABLE unit_set (  -- matching: A set of primitives that a matcher sees: of one image.
    id BIGINT PRIMARY KEY,  -- identity of the set
    kind TEXT NOT NULL,  -- extraction: arcs, then regions of a picture; view: arcs, then surfaces that a camera should see at a pose
    extraction_id BIGINT,  -- REFERENCES extraction (id): the extraction whose arcs and regions they are; null of a view
    run_id BIGINT,  -- the run that predicted the view; null of an extraction
    view_no INTEGER,  -- REFERENCES inspection_image (run_id, view_no): the view of that run; null of an extraction
    CHECK (kind IN ('extraction', 'view')),
    CHECK ((kind = 'extraction') = (extraction_id IS NOT NULL)),
    CHECK ((kind = 'view') = (run_id IS NOT NULL AND view_no IS NOT NULL))
);

-- Without keys, as the arcs and regions of images.
CREATE TABLE unit (  -- matching: A primitive as a matcher sees it.
    unit_set_id BIGINT NOT NULL,  -- the set
    unit_no INTEGER NOT NULL,  -- ordinal in the set, from 0
    kind TEXT NOT NULL,  -- arc, region, view_arc or view_surface
    ref_no INTEGER NOT NULL,  -- image_arc_no, region_no, view_arc_no or view_surface_no of what it stands for
    CHECK (kind IN ('arc', 'region', 'view_arc', 'view_surface'))
);

-- Without keys, as the units: some 6,000 rows a picture.
CREATE TABLE unit_relation (  -- matching: Relations of two units, each a distance and an angle, stored with their inverse but for surrounds.
    unit_set_id BIGINT NOT NULL,  -- the set
    kind TEXT NOT NULL,  -- near, parallel, perpendicular, junction (an end of one at the other), concentric, equal_radius, bounds, adjacent,
        -- surrounds (a is the outer one)
    unit_a INTEGER NOT NULL,  -- one unit
    unit_b INTEGER NOT NULL,  -- the other
    distance REAL NOT NULL,  -- px: least gap of near, perpendicular, junction; offset of the middle of b to the left of the line of a of parallel;
        -- between the centres of concentric; radius of b less that of a of equal_radius; length of the common border of bounds, adjacent, surrounds
    distance_sigma REAL NOT NULL,  -- standard deviation of the distance, px
    angle REAL NOT NULL,  -- rad: bearing of the middle of b from that of a, from x towards y, of near, bounds, adjacent, surrounds (above -pi, at
        -- most pi); between the two of parallel, perpendicular, junction (0 to pi/2); 0 of concentric, equal_radius
    angle_sigma REAL NOT NULL  -- standard deviation of the angle, rad; 0 where the kind has none
);

CREATE TABLE problem (  -- matching: One matching problem of a run: units to be given labels, and how it ended.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run
    problem_no INTEGER NOT NULL,  -- ordinal in the run, from 0
    kind TEXT NOT NULL,  -- stereo or localisation
    method TEXT NOT NULL,  -- method that solved it
    units_id BIGINT NOT NULL,  -- REFERENCES unit_set (id): units that get labels
    labels_id BIGINT NOT NULL,  -- REFERENCES unit_set (id): labels that they get
    parameters JSON NOT NULL,  -- parameters of the method, defaults included
    injective BOOLEAN NOT NULL,  -- whether no label may be taken twice
    nat_cost DOUBLE PRECISION NOT NULL,  -- what a nat of a relation costs, in the integers of the costs
    relation_weight INTEGER,  -- what all relations of a unit weigh together, about, as they repeat much the same information; null where each weighs
        -- what its kinds do
    status TEXT NOT NULL,  -- optimal (the bound meets the cost), bounded or stopped
    cost DOUBLE PRECISION NOT NULL,  -- cost of the assignment found
    bound DOUBLE PRECISION NOT NULL,  -- proved lower bound of the cost
    PRIMARY KEY (run_id, problem_no),
    CHECK (kind IN ('stereo', 'localisation')),
    CHECK (status IN ('optimal', 'bounded', 'stopped'))
);

CREATE TABLE candidate (  -- matching: Pairs of unit and label that passed the gate, with the cost of each by itself.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- REFERENCES problem (run_id, problem_no): the problem
    unit_no INTEGER NOT NULL,  -- the unit
    label_no INTEGER NOT NULL,  -- the label
    cost DOUBLE PRECISION NOT NULL,  -- unary cost of the pair
    across DOUBLE PRECISION,  -- how far the unit lies off the label, in the mean, to the left of it, px; null of regions and in stereo
    across_sigma DOUBLE PRECISION,  -- standard deviation of that, the pose known, px
    shift_1 DOUBLE PRECISION, shift_2 DOUBLE PRECISION, shift_3 DOUBLE PRECISION,  -- how a standard deviation of the pose along the first axes of its covariance moves the label to its left, px
    shift_4 DOUBLE PRECISION, shift_5 DOUBLE PRECISION, shift_6 DOUBLE PRECISION,  -- the same along its other axes, px
    PRIMARY KEY (run_id, problem_no, unit_no, label_no)
);

CREATE TABLE problem_tolerance (  -- matching: How relations of labels differ from those of the units which they confirm, and what a relation tells.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- REFERENCES problem (run_id, problem_no): the problem
    kind TEXT NOT NULL,  -- kind of relation, as in unit_relation; kinds that are not listed count for nothing
    distance DOUBLE PRECISION NOT NULL,  -- standard deviation of the difference of the distances, besides their own and the share, px
    distance_share DOUBLE PRECISION NOT NULL,  -- the same as a share of the distance of the units, added to it
    angle DOUBLE PRECISION NOT NULL,  -- standard deviation of the difference of the angles, besides their own, rad
    reach DOUBLE PRECISION NOT NULL,  -- greatest distance at which a relation of units asks to be confirmed, px; relations of labels confirm at any
    nats DOUBLE PRECISION NOT NULL,  -- what a relation tells that agrees fully; so much less likely than that, it confirms nothing
    PRIMARY KEY (run_id, problem_no, kind)
);

-- Without keys, as the compatibilities: many rows, and queries/check finds what is there twice.
CREATE TABLE problem_relation (  -- matching, redundant: Neighbours of a unit in a problem, and what it costs when one confirms nothing of its label.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- the problem
    unit_no INTEGER NOT NULL,  -- the unit that pays
    neighbour_no INTEGER NOT NULL,  -- the unit whose label confirms or does not
    weight INTEGER NOT NULL,  -- what the unit pays, if it has a label, where that does not
    CHECK (unit_no <> neighbour_no AND weight >= 0)
);

CREATE TABLE compatibility (  -- matching, redundant: Pairs of candidates that confirm each other, stored once.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- REFERENCES problem (run_id, problem_no): the problem
    unit_a INTEGER NOT NULL,  -- the unit of lower number
    label_a INTEGER NOT NULL,  -- its label
    unit_b INTEGER NOT NULL,  -- the other unit
    label_b INTEGER NOT NULL,  -- its label
    saves INTEGER NOT NULL,  -- what each of the two units saves of its relation to the other, at most its weight
    CHECK (unit_a < unit_b AND saves >= 0)
);

CREATE VIEW due_relation (  -- matching: The relations that a problem has by its candidates, the relations of its units and its tolerances.
    run_id,  -- the run
    problem_no,  -- the problem
    unit_no,  -- the unit that pays
    neighbour_no,  -- the unit whose label confirms or does not
    weight  -- what the unit pays, if it has a label, where that confirms nothing
) AS
WITH gated AS (
    SELECT run_id, problem_no, unit_no, max(across) IS NOT NULL AS is_placed
    FROM candidate GROUP BY run_id, problem_no, unit_no
),
related AS (
    SELECT p.run_id, p.problem_no, p.relation_weight, r.unit_a, r.unit_b,
        sum(CAST(greatest(1, floor(t.nats * p.nat_cost + 0.5)) AS INTEGER)) AS weight
    FROM problem AS p
    JOIN unit_relation AS r ON r.unit_set_id = p.units_id
    JOIN problem_tolerance AS t ON t.run_id = p.run_id AND t.problem_no = p.problem_no AND t.kind = r.kind
        AND abs(r.distance) <= t.reach
    JOIN gated AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.unit_no = r.unit_a
    JOIN gated AS b ON b.run_id = p.run_id AND b.problem_no = p.problem_no AND b.unit_no = r.unit_b
    WHERE b.is_placed OR NOT a.is_placed  -- arcs confirm arcs only; both confirm regions
    GROUP BY p.run_id, p.problem_no, p.relation_weight, r.unit_a, r.unit_b
),
whole AS (
    SELECT run_id, problem_no, unit_a, sum(weight) AS weight FROM related GROUP BY run_id, problem_no, unit_a
)
SELECT r.run_id, r.problem_no, r.unit_a AS unit_no, r.unit_b AS neighbour_no,
    -- of a unit that all of it is to weigh the same: the mean of the shares that the pair has in both
    CAST(CASE WHEN r.relation_weight IS NULL THEN r.weight
        ELSE greatest(1, floor(0.5 + 0.5 * r.relation_weight
            * (CAST(r.weight AS DOUBLE PRECISION) / a.weight
                + CAST(r.weight AS DOUBLE PRECISION) / coalesce(b.weight, r.weight)))) END AS INTEGER) AS weight
FROM related AS r
JOIN whole AS a ON a.run_id = r.run_id AND a.problem_no = r.problem_no AND a.unit_a = r.unit_a
LEFT JOIN whole AS b ON b.run_id = r.run_id AND b.problem_no = r.problem_no AND b.unit_a = r.unit_b;

CREATE VIEW due_compatibility (  -- matching: The pairs of candidates that confirm each other by the relations of units and labels, and what they save.
    run_id,  -- the run
    problem_no,  -- the problem
    unit_a,  -- the unit of lower number
    label_a,  -- its label
    unit_b,  -- the other unit
    label_b,  -- its label
    saves  -- what each of the two units saves of its relation to the other
) AS
WITH place AS (
    SELECT run_id, problem_no, unit_no, label_no, across, shift_1, shift_2, shift_3, shift_4, shift_5, shift_6,
        sqrt(across_sigma * across_sigma + shift_1 * shift_1 + shift_2 * shift_2 + shift_3 * shift_3 + shift_4 * shift_4
            + shift_5 * shift_5 + shift_6 * shift_6) AS spread
    FROM candidate
),
compared AS (
    SELECT p.run_id, p.problem_no, p.injective, r.unit_a, a.label_no AS label_a, r.unit_b, b.label_no AS label_b, t.nats,
        CAST(greatest(1, floor(t.nats * p.nat_cost + 0.5)) AS INTEGER) AS weight,
        a.across / a.spread AS off_a, b.across / b.spread AS off_b,
        (a.shift_1 * b.shift_1 + a.shift_2 * b.shift_2 + a.shift_3 * b.shift_3 + a.shift_4 * b.shift_4
            + a.shift_5 * b.shift_5 + a.shift_6 * b.shift_6) / (a.spread * b.spread) AS correlation,
        CAST(r.distance AS DOUBLE PRECISION) - CAST(s.distance AS DOUBLE PRECISION) AS longer,
        t.distance + t.distance_share * abs(CAST(r.distance AS DOUBLE PRECISION)) AS cut,
        CAST(r.distance_sigma AS DOUBLE PRECISION) AS sigma_r, CAST(s.distance_sigma AS DOUBLE PRECISION) AS sigma_s,
        -- angles are those of a full turn: 3.1 and -3.1 differ by .08
        CAST(r.angle AS DOUBLE PRECISION) - CAST(s.angle AS DOUBLE PRECISION)
            - 2 * pi() * round((CAST(r.angle AS DOUBLE PRECISION) - CAST(s.angle AS DOUBLE PRECISION))
                / (2 * pi())) AS turned,
        t.angle AS loose,
        CAST(r.angle_sigma AS DOUBLE PRECISION) AS turn_r, CAST(s.angle_sigma AS DOUBLE PRECISION) AS turn_s
    FROM problem AS p
    JOIN unit_relation AS r ON r.unit_set_id = p.units_id AND (r.unit_a < r.unit_b OR r.kind = 'surrounds')
    JOIN problem_tolerance AS t ON t.run_id = p.run_id AND t.problem_no = p.problem_no AND t.kind = r.kind
        AND abs(r.distance) <= t.reach
    JOIN place AS a ON a.run_id = p.run_id AND a.problem_no = p.problem_no AND a.unit_no = r.unit_a
    JOIN place AS b ON b.run_id = p.run_id AND b.problem_no = p.problem_no AND b.unit_no = r.unit_b
    LEFT JOIN unit_relation AS s ON s.unit_set_id = p.labels_id AND s.kind = r.kind
        AND s.unit_a = a.label_no AND s.unit_b = b.label_no
),
agreed AS (
    SELECT run_id, problem_no,
        least(unit_a, unit_b) AS unit_a, CASE WHEN unit_a < unit_b THEN label_a ELSE label_b END AS label_a,
        greatest(unit_a, unit_b) AS unit_b, CASE WHEN unit_a < unit_b THEN label_b ELSE label_a END AS label_b, weight,
        nats, CASE
            WHEN injective AND label_a = label_b THEN nats
            -- How far two arcs are off follows from the pose; that they are off alike is likely, by its covariance, or not.
            WHEN correlation IS NOT NULL
                THEN 0.25 * (off_a - CASE WHEN correlation < 0 THEN -off_b ELSE off_b END)
                    * (off_a - CASE WHEN correlation < 0 THEN -off_b ELSE off_b END) * (1 / (1 - abs(correlation)) - 1)
            WHEN label_a = label_b THEN 0  -- pieces of one thing
            WHEN longer IS NULL THEN nats
            ELSE 0.5 * (longer * longer / (cut * cut + sigma_r * sigma_r + sigma_s * sigma_s)
                + turned * turned / (loose * loose + turn_r * turn_r + turn_s * turn_s))
        END AS less_likely
    FROM compared
),
shared AS (  -- whole thousandths, the same in any order
    SELECT run_id, problem_no, unit_a, label_a, unit_b, label_b,
        CAST(sum(weight * CAST(floor(0.5 + 1000 * greatest(0, 1 - less_likely / nats)) AS INTEGER)) AS DOUBLE PRECISION)
            / (1000 * sum(weight)) AS share
    FROM agreed
    GROUP BY run_id, problem_no, unit_a, label_a, unit_b, label_b
),
saving AS (
    SELECT c.run_id, c.problem_no, c.unit_a, c.label_a, c.unit_b, c.label_b,
        CAST(floor(0.5 + c.share * greatest(coalesce(r.weight, 0), coalesce(i.weight, 0))) AS INTEGER) AS saves
    FROM shared AS c
    LEFT JOIN problem_relation AS r ON r.run_id = c.run_id AND r.problem_no = c.problem_no
        AND r.unit_no = c.unit_a AND r.neighbour_no = c.unit_b
    LEFT JOIN problem_relation AS i ON i.run_id = c.run_id AND i.problem_no = c.problem_no
        AND i.unit_no = c.unit_b AND i.neighbour_no = c.unit_a
)
SELECT run_id, problem_no, unit_a, label_a, unit_b, label_b, saves FROM saving WHERE saves > 0;

CREATE TABLE assignment (  -- matching: What the matcher decided for each unit.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- REFERENCES problem (run_id, problem_no): the problem
    unit_no INTEGER NOT NULL,  -- the unit
    label_no INTEGER,  -- its label; null where it has none
    cost DOUBLE PRECISION NOT NULL,  -- what this decision costs
    null_cost DOUBLE PRECISION NOT NULL,  -- what it costs to leave the unit without a label
    reason TEXT NOT NULL,  -- matched, or why not: no_candidate, null_cheaper, taken
    PRIMARY KEY (run_id, problem_no, unit_no),
    CHECK ((label_no IS NOT NULL) = (reason = 'matched'))
);

CREATE TABLE search_node (  -- matching: Sets of labellings that a search split a problem into, each with a lower bound of what they cost.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- REFERENCES problem (run_id, problem_no): the problem
    node_no INTEGER NOT NULL,  -- ordinal in the search, from 0, the root
    parent_no INTEGER,  -- node that it is part of
    depth INTEGER NOT NULL,  -- depth in the tree
    branch TEXT NOT NULL,  -- root: all labellings; take: those of the parent in which the unit has the label; rest: those that are in no take of the
        -- parent
    unit_no INTEGER,  -- unit that takes a label
    label_no INTEGER,  -- the label; null for none
    bound DOUBLE PRECISION NOT NULL,  -- no labelling of the node costs less, or none costs less than the one found
    status TEXT NOT NULL,  -- branched (its children are what it holds), pruned or open
    PRIMARY KEY (run_id, problem_no, node_no),
    CHECK (branch IN ('root', 'take', 'rest')),
    CHECK ((parent_no IS NULL) = (branch = 'root')),
    CHECK ((unit_no IS NOT NULL) = (branch = 'take')),
    CHECK (status IN ('branched', 'pruned', 'open'))
);

CREATE TABLE triangulated_unit (  -- matching: Stereo matches in space: matched arcs as curves in the frame of the rig, with both ends.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- the problem
    unit_no INTEGER NOT NULL,  -- REFERENCES assignment (run_id, problem_no, unit_no): the unit of the first image
    curve TEXT NOT NULL,  -- line, circle, ellipse (centre + cos t major + sin t minor) or free
    start_x DOUBLE PRECISION NOT NULL, start_y DOUBLE PRECISION NOT NULL, start_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the first end of the part that both images show, along the arc of the first image, mm, in the rig's frame
    end_x DOUBLE PRECISION NOT NULL, end_y DOUBLE PRECISION NOT NULL, end_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the last end of that part, mm, in the rig's frame
    edge_probability DOUBLE PRECISION NOT NULL,  -- how probably it is an edge of an object, and not what lies on it: texture, reflections, shadows
    covariance DOUBLE PRECISION[] NOT NULL,  -- covariance of start and end, 6x6 row by row, mm^2, in the rig's frame
    centre_x DOUBLE PRECISION, centre_y DOUBLE PRECISION, centre_z DOUBLE PRECISION,  -- x, y and z of the centre of a circle or ellipse, mm, in the rig's frame; null for other curves
    major_x DOUBLE PRECISION, major_y DOUBLE PRECISION, major_z DOUBLE PRECISION,  -- x, y and z of the major semi-axis, mm, in the rig's frame; of a circle, any radius
    minor_x DOUBLE PRECISION, minor_y DOUBLE PRECISION, minor_z DOUBLE PRECISION,  -- x, y and z of the minor semi-axis, mm, in the rig's frame
    conic_covariance DOUBLE PRECISION[],  -- covariance of centre, unit normal and radius, 7x7 row by row, mm and rad; null for other curves
    PRIMARY KEY (run_id, problem_no, unit_no),
    CHECK (curve IN ('line', 'circle', 'ellipse', 'free')),
    CHECK (covariance[36] IS NOT NULL AND covariance[37] IS NULL AND covariance[1] > 0 AND covariance[22] > 0),
    CHECK ((centre_x IS NOT NULL) = (curve IN ('circle', 'ellipse'))),
    CHECK (edge_probability BETWEEN 0 AND 1),
    CHECK ((conic_covariance IS NOT NULL) = (centre_x IS NOT NULL))
);

CREATE TABLE space_relation (  -- matching, redundant: How circles and straight edges that stereo puts in space lie to each other, two by two: what the join is given, with standard deviations.
    run_id BIGINT NOT NULL,  -- the run
    problem_no INTEGER NOT NULL,  -- the stereo problem
    unit_a INTEGER NOT NULL,  -- REFERENCES triangulated_unit (run_id, problem_no, unit_no): the first unit
    unit_b INTEGER NOT NULL,  -- REFERENCES triangulated_unit (run_id, problem_no, unit_no): the second unit
    kind TEXT NOT NULL,  -- circles or lines
    distance DOUBLE PRECISION NOT NULL,  -- from centre to centre; of lines from one to the other, its sign that of the turn; mm
    distance_sigma DOUBLE PRECISION NOT NULL,  -- standard deviation of the distance, mm
    radius_a DOUBLE PRECISION, radius_b DOUBLE PRECISION,  -- radius of the first and of the second circle, mm
    radius_a_sigma DOUBLE PRECISION, radius_b_sigma DOUBLE PRECISION,  -- standard deviation of the radius of the first and of the second circle, mm
    normals DOUBLE PRECISION,  -- cosine of the angle between the normals of circles, which have no sign
    normals_sigma DOUBLE PRECISION,  -- standard deviation of that cosine
    rise_a DOUBLE PRECISION, rise_b DOUBLE PRECISION,  -- cosine of the angle between the connecting line and the normal of the first and of the second circle
    rise_a_sigma DOUBLE PRECISION, rise_b_sigma DOUBLE PRECISION,  -- standard deviation of the cosine of the first and of the second circle
    cosine DOUBLE PRECISION,  -- cosine of the angle between lines
    cosine_sigma DOUBLE PRECISION,  -- standard deviation of that cosine
    alike BIGINT NOT NULL,  -- how many relations of the inspected objects it is like; 0 also where these were too many to be joined
    PRIMARY KEY (run_id, problem_no, kind, unit_a, unit_b),
    CHECK (kind IN ('circles', 'lines')),
    CHECK (alike >= 0)
);
