-- Presence: what is there and what is not, by the evidence of the pictures at the pose found.

CREATE TABLE presence (  -- localisation: The parts, features and surfaces that a view should show, each with a state and what it rests on; of inspected objects,
    -- where the pose is not refused.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    item_no INTEGER NOT NULL,  -- ordinal in the run, from 0: parts, then features, then surfaces
    level TEXT NOT NULL,  -- part, feature or surface
    occurrence_id BIGINT NOT NULL,  -- the placed part
    feature_no INTEGER,  -- feature of its shape; null for others
    surface_no INTEGER,  -- surface of its shape; null for others
    path TEXT NOT NULL,  -- path of the part, with the name of the feature or the number of the face
    state TEXT NOT NULL,  -- confirmed, contradicted (something else is there), changed (there, in another size or place), not_confirmed (should be
        -- seen and is not) or undecidable
    qif TEXT NOT NULL,  -- the state in the words of QIF results (ISO 23952): PASS, FAIL, INDETERMINATE or NOT_ANALYZED
    reason TEXT NOT NULL,  -- why, one sentence
    log_odds DOUBLE PRECISION NOT NULL,  -- natural logarithm of how much likelier the edges found are with it where the model has it than without it;
        -- over all cameras
    expected_log_odds DOUBLE PRECISION NOT NULL,  -- what that would be in the mean, were it there: little where little contrast is expected
    visible_pixels DOUBLE PRECISION NOT NULL,  -- pixels it shows, over all cameras
    edge_px DOUBLE PRECISION NOT NULL,  -- length of its sharp edges and outlines in view, px, over all cameras
    distinct_px DOUBLE PRECISION NOT NULL,  -- of those, what can be distinguished from other edges and from the border of the picture, px
    supported_px DOUBLE PRECISION NOT NULL,  -- of those, what edge elements support, px
    moved_mm DOUBLE PRECISION,  -- how far outward that surface of it lies from its place that has moved most surely, mm; null where none has
    moved_sigma_mm DOUBLE PRECISION,  -- standard deviation of that, mm
    moved_log_odds DOUBLE PRECISION,  -- natural logarithm of the odds of that place against the model's
    uncovered_log_odds DOUBLE PRECISION,  -- of a part whose edges are not surely found: log odds that what it covers shows in its place, against its being there;
        -- null of others, and where it covers no edge
    absent_log_odds DOUBLE PRECISION NOT NULL,  -- log odds that some of its edges are not there, against all being there and some not showing
    PRIMARY KEY (run_id, item_no),
    CHECK (level IN ('part', 'feature', 'surface')),
    CHECK ((level = 'feature') = (feature_no IS NOT NULL) AND (level = 'surface') = (surface_no IS NOT NULL)),
    CHECK (state IN ('confirmed', 'contradicted', 'changed', 'not_confirmed', 'undecidable')),
    CHECK (qif IN ('PASS', 'FAIL', 'INDETERMINATE', 'NOT_ANALYZED')),
    CHECK (supported_px >= 0 AND supported_px <= distinct_px + 1e-6 AND distinct_px <= edge_px + 1e-6),
    CHECK ((moved_mm IS NULL) = (moved_sigma_mm IS NULL) AND (moved_mm IS NULL) = (moved_log_odds IS NULL))
);

CREATE TABLE presence_camera (  -- localisation: What single cameras say of an item.
    run_id BIGINT NOT NULL,  -- the run
    item_no INTEGER NOT NULL,  -- REFERENCES presence (run_id, item_no): the item
    camera TEXT NOT NULL,  -- name of the camera in the rig
    log_odds DOUBLE PRECISION NOT NULL,  -- as in presence, by this camera
    expected_log_odds DOUBLE PRECISION NOT NULL,  -- as in presence, by this camera
    edge_px DOUBLE PRECISION NOT NULL,  -- as in presence, by this camera
    distinct_px DOUBLE PRECISION NOT NULL,  -- as in presence, by this camera
    supported_px DOUBLE PRECISION NOT NULL,  -- as in presence, by this camera
    inside_grey DOUBLE PRECISION,  -- mean grey of what is seen of a feature or surface, and through a hole, 0..255; this and the next four are null where too
        -- little is seen
    around_grey DOUBLE PRECISION,  -- mean grey of what is around it
    like_grey DOUBLE PRECISION,  -- mean grey of what it would look like: faces turned alike, and what lies behind the object elsewhere
    appearance_log_odds DOUBLE PRECISION,  -- log odds of there against not there by grey and texture, in log_odds
    stopped BOOLEAN,  -- whether all cameras together see something through it that does not lie behind
    PRIMARY KEY (run_id, item_no, camera),
    CHECK ((inside_grey IS NULL) = (stopped IS NULL) AND (inside_grey IS NULL) = (appearance_log_odds IS NULL))
);

CREATE TABLE measured_size (  -- localisation: Sizes of items that their edges give, and distances between them, whether they differ from the model or not.
    run_id BIGINT NOT NULL,  -- the run
    measure_no INTEGER NOT NULL,  -- ordinal in the run, from 0
    item_no INTEGER NOT NULL,  -- REFERENCES presence (run_id, item_no): the item
    other_item_no INTEGER,  -- REFERENCES presence (run_id, item_no): of a distance the other feature; null of others
    what TEXT NOT NULL,  -- distance (between the axes of neighbouring holes and bosses in one plane), diameter, thickness, width (between walls of a pocket that face each other), shift (how far aside a bore or pin lies)
        -- offset (how far outward a surface lies), or of a part that lies elsewhere displacement, dx, dy, dz (along the world's axes) and turn (about
        -- the normal of its plane, counter-clockwise as the cameras see it)
    nominal DOUBLE PRECISION NOT NULL,  -- the model's
    value DOUBLE PRECISION NOT NULL,  -- the measured one
    sigma DOUBLE PRECISION NOT NULL,  -- its standard deviation
    unit TEXT NOT NULL,  -- mm, of a turn deg
    changed BOOLEAN NOT NULL,  -- whether it is surely another than the model's: an item is in the state changed where one of its sizes is, other
        -- than a distance
    PRIMARY KEY (run_id, measure_no),
    CHECK (what IN ('distance', 'diameter', 'shift', 'thickness', 'width', 'offset', 'displacement', 'dx', 'dy', 'dz', 'turn')),
    CHECK (sigma > 0),
    CHECK ((what = 'distance') = (other_item_no IS NOT NULL)),
    CHECK (what <> 'distance' OR (item_no < other_item_no AND nominal > 0))
);

CREATE TABLE unexplained (  -- localisation: What a picture shows where the model shows nothing: arcs that form something and belong to no predicted edge, and
    -- regions that most of their border surrounds with such; texture is left out.
    run_id BIGINT NOT NULL,  -- the run
    unexplained_no INTEGER NOT NULL,  -- ordinal in the run, from 0, the most telling first
    camera TEXT NOT NULL,  -- REFERENCES inspection_image (run_id, camera): name of the camera in the rig
    kind TEXT NOT NULL,  -- closed, curved or straight, of an arc, or region
    image_arc_no INTEGER,  -- the arc in the extraction of that camera's picture; null of a region
    region_no INTEGER,  -- the region in that extraction; null of an arc
    u0 DOUBLE PRECISION NOT NULL, v0 DOUBLE PRECISION NOT NULL,  -- least x and y of it, px
    u1 DOUBLE PRECISION NOT NULL, v1 DOUBLE PRECISION NOT NULL,  -- greatest x and y of it, px
    length DOUBLE PRECISION NOT NULL,  -- length, px; of a region that of its border along unexplained arcs
    contrast DOUBLE PRECISION NOT NULL,  -- mean height of the step along it, grey levels of 0..255
    beyond BOOLEAN NOT NULL,  -- whether most of it lies where the model shows nothing at all
    PRIMARY KEY (run_id, unexplained_no),
    CHECK (kind IN ('closed', 'curved', 'straight', 'region')),
    CHECK ((kind = 'region') = (region_no IS NOT NULL) AND (kind = 'region') = (image_arc_no IS NULL)),
    CHECK (u0 <= u1 AND v0 <= v1 AND length > 0)
);

CREATE TABLE variant_evidence (  -- localisation: What the pictures say at the pose found of each loaded variant of an inspected object, where something is not as
    -- the model says or it was asked for.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    rank_no INTEGER NOT NULL,  -- ordinal in the run, from 0: by object, the likeliest variant first
    object_no INTEGER NOT NULL,  -- the object of the run's world in whose place the variant is weighed
    object_variant_id BIGINT NOT NULL,  -- REFERENCES object_variant (id): the variant
    placed BOOLEAN NOT NULL,  -- whether it is the one that the world has there
    log_odds DOUBLE PRECISION NOT NULL,  -- natural logarithm of the odds of its visible edges, of each there against not there, summed
    against INTEGER NOT NULL,  -- how many of its parts and features in view differ from it
    decided INTEGER NOT NULL,  -- how many of its parts and features in view are decided at all
    distinguished_by TEXT[],  -- paths of parts and features that distinguish it from the likeliest variant of the object: they differ from this one,
        -- and are right or absent in that one; worst first; null where there are none
    PRIMARY KEY (run_id, rank_no),
    UNIQUE (run_id, object_no, object_variant_id),
    CHECK (against >= 0 AND against <= decided)
);

CREATE TABLE considered_object (  -- localisation: The loaded objects that the pictures were compared with where no world was given, a row for each variant.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    rank_no INTEGER NOT NULL,  -- ordinal in the run, from 0: what is shown first
    object_variant_id BIGINT NOT NULL,  -- REFERENCES object_variant (id): the variant
    score DOUBLE PRECISION,  -- what the best pose of its join explains, as search_pose has it; null where the join gave none
    state TEXT NOT NULL,  -- shown, alike (explains the same edges about as well), outdone (explains them less well), refused, or left (its join
        -- explains too little, compared with the best, to be localised)
    verdict TEXT,  -- accepted, ambiguous or refused: of its own pose; null where it was not localised
    posterior DOUBLE PRECISION,  -- probability that its pose is right; null likewise
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,  -- object_from_rig; null where it has no pose
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    PRIMARY KEY (run_id, rank_no),
    UNIQUE (run_id, object_variant_id),
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (state IN ('shown', 'alike', 'outdone', 'refused', 'left')),
    CHECK (verdict IN ('accepted', 'ambiguous', 'refused')),
    CHECK (posterior BETWEEN 0 AND 1)
);
