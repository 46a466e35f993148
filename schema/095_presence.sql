-- Presence: what is there and what is not, by the evidence of the pictures at the pose found.

CREATE TABLE presence (
    run_id BIGINT NOT NULL,
    item_no INTEGER NOT NULL,
    level TEXT NOT NULL,
    occurrence_id BIGINT NOT NULL,
    feature_no INTEGER,
    surface_no INTEGER,
    path TEXT NOT NULL,
    state TEXT NOT NULL,
    qif TEXT NOT NULL,
    reason TEXT NOT NULL,
    log_odds DOUBLE PRECISION NOT NULL,
    expected_log_odds DOUBLE PRECISION NOT NULL,
    visible_pixels DOUBLE PRECISION NOT NULL,
    edge_px DOUBLE PRECISION NOT NULL,
    told_px DOUBLE PRECISION NOT NULL,
    supported_px DOUBLE PRECISION NOT NULL,
    region_px DOUBLE PRECISION NOT NULL,
    moved_mm DOUBLE PRECISION,
    moved_sigma_mm DOUBLE PRECISION,
    moved_log_odds DOUBLE PRECISION,
    PRIMARY KEY (run_id, item_no),
    CHECK (level IN ('part', 'feature', 'surface')),
    CHECK ((level = 'feature') = (feature_no IS NOT NULL) AND (level = 'surface') = (surface_no IS NOT NULL)),
    CHECK (state IN ('confirmed', 'contradicted', 'changed', 'not_confirmed', 'undecidable')),
    CHECK (qif IN ('PASS', 'FAIL', 'INDETERMINATE', 'NOT_ANALYZED')),
    CHECK (supported_px >= 0 AND supported_px <= told_px + 1e-6 AND told_px <= edge_px + 1e-6),
    CHECK ((moved_mm IS NULL) = (moved_sigma_mm IS NULL) AND (moved_mm IS NULL) = (moved_log_odds IS NULL))
);
COMMENT ON TABLE presence IS 'The parts, features and surfaces that a view should show, each with a state and what it rests on; of inspected objects, where the pose is not refused.';
COMMENT ON COLUMN presence.run_id IS 'the run';
COMMENT ON COLUMN presence.item_no IS 'ordinal in the run, from 0: parts, then features, then surfaces';
COMMENT ON COLUMN presence.level IS 'part, feature or surface';
COMMENT ON COLUMN presence.occurrence_id IS 'the placed part';
COMMENT ON COLUMN presence.feature_no IS 'feature of its shape; null for others';
COMMENT ON COLUMN presence.surface_no IS 'surface of its shape; null for others';
COMMENT ON COLUMN presence.path IS 'path of the part, with the name of the feature or the number of the face';
COMMENT ON COLUMN presence.state IS 'confirmed, contradicted (something else is there), changed (there, in another size or place), not_confirmed (should be seen and is not) or undecidable';
COMMENT ON COLUMN presence.qif IS 'the state in the words of QIF results (ISO 23952): PASS, FAIL, INDETERMINATE or NOT_ANALYZED';
COMMENT ON COLUMN presence.reason IS 'why, one sentence';
COMMENT ON COLUMN presence.log_odds IS 'natural logarithm of how much likelier the edges found are with it where the model has it than without it; over all cameras';
COMMENT ON COLUMN presence.expected_log_odds IS 'what that would be in the mean, were it there: little where little contrast is expected';
COMMENT ON COLUMN presence.visible_pixels IS 'pixels it shows, over all cameras';
COMMENT ON COLUMN presence.edge_px IS 'length of its sharp edges and outlines in view, px, over all cameras';
COMMENT ON COLUMN presence.told_px IS 'of those, what can be told from other edges and from the border of the picture, px';
COMMENT ON COLUMN presence.supported_px IS 'of those, what edge elements support, px';
COMMENT ON COLUMN presence.region_px IS 'pixels of its surfaces that regions of the pictures cover which lie on them alone (surface_match)';
COMMENT ON COLUMN presence.moved_mm IS 'how far outward that surface of it lies from its place that has moved most surely, mm; null where none has';
COMMENT ON COLUMN presence.moved_sigma_mm IS 'standard deviation of that, mm';
COMMENT ON COLUMN presence.moved_log_odds IS 'natural logarithm of the odds of that place against the model''s';

CREATE TABLE presence_camera (
    run_id BIGINT NOT NULL,
    item_no INTEGER NOT NULL,
    camera TEXT NOT NULL,
    log_odds DOUBLE PRECISION NOT NULL,
    expected_log_odds DOUBLE PRECISION NOT NULL,
    edge_px DOUBLE PRECISION NOT NULL,
    told_px DOUBLE PRECISION NOT NULL,
    supported_px DOUBLE PRECISION NOT NULL,
    region_px DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, item_no, camera)
);
COMMENT ON TABLE presence_camera IS 'What single cameras say of an item.';
COMMENT ON COLUMN presence_camera.run_id IS 'the run';
COMMENT ON COLUMN presence_camera.item_no IS 'the item';
COMMENT ON COLUMN presence_camera.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN presence_camera.log_odds IS 'as in presence, by this camera';
COMMENT ON COLUMN presence_camera.expected_log_odds IS 'as in presence, by this camera';
COMMENT ON COLUMN presence_camera.edge_px IS 'as in presence, by this camera';
COMMENT ON COLUMN presence_camera.told_px IS 'as in presence, by this camera';
COMMENT ON COLUMN presence_camera.supported_px IS 'as in presence, by this camera';
COMMENT ON COLUMN presence_camera.region_px IS 'as in presence, by this camera';

CREATE TABLE measured_size (
    run_id BIGINT NOT NULL,
    measure_no INTEGER NOT NULL,
    item_no INTEGER NOT NULL,
    what TEXT NOT NULL,
    nominal DOUBLE PRECISION NOT NULL,
    value DOUBLE PRECISION NOT NULL,
    sigma DOUBLE PRECISION NOT NULL,
    unit TEXT NOT NULL,
    changed BOOLEAN NOT NULL,
    PRIMARY KEY (run_id, measure_no),
    CHECK (what IN ('diameter', 'shift', 'thickness', 'width', 'offset', 'displacement', 'dx', 'dy', 'dz', 'turn')),
    CHECK (sigma > 0)
);
COMMENT ON TABLE measured_size IS 'Sizes of items that their edges give, whether they differ from the model or not.';
COMMENT ON COLUMN measured_size.run_id IS 'the run';
COMMENT ON COLUMN measured_size.measure_no IS 'ordinal in the run, from 0';
COMMENT ON COLUMN measured_size.item_no IS 'the item';
COMMENT ON COLUMN measured_size.what IS 'diameter, thickness, width (between walls of a pocket that face each other), shift (how far aside a bore or pin lies) offset (how far outward a surface lies), or of a part that lies elsewhere displacement, dx, dy, dz (along the world''s axes) and turn (about the normal of its plane, counter-clockwise as the cameras see it)';
COMMENT ON COLUMN measured_size.nominal IS 'the model''s';
COMMENT ON COLUMN measured_size.value IS 'the measured one';
COMMENT ON COLUMN measured_size.sigma IS 'its standard deviation';
COMMENT ON COLUMN measured_size.unit IS 'mm, of a turn deg';
COMMENT ON COLUMN measured_size.changed IS 'whether it is surely another than the model''s: an item is in the state changed where one of its sizes is';

CREATE TABLE measured_distance (
    run_id BIGINT NOT NULL,
    distance_no INTEGER NOT NULL,
    item_no INTEGER NOT NULL,
    other_item_no INTEGER NOT NULL,
    nominal DOUBLE PRECISION NOT NULL,
    value DOUBLE PRECISION NOT NULL,
    sigma DOUBLE PRECISION NOT NULL,
    changed BOOLEAN NOT NULL,
    PRIMARY KEY (run_id, distance_no),
    CHECK (item_no < other_item_no),
    CHECK (sigma > 0 AND nominal > 0)
);
COMMENT ON TABLE measured_distance IS 'Distances between the axes of measured holes and bosses that stand beside each other in one plane.';
COMMENT ON COLUMN measured_distance.run_id IS 'the run';
COMMENT ON COLUMN measured_distance.distance_no IS 'ordinal in the run, from 0';
COMMENT ON COLUMN measured_distance.item_no IS 'one feature';
COMMENT ON COLUMN measured_distance.other_item_no IS 'the other';
COMMENT ON COLUMN measured_distance.nominal IS 'the model''s, mm';
COMMENT ON COLUMN measured_distance.value IS 'the measured one, mm';
COMMENT ON COLUMN measured_distance.sigma IS 'its standard deviation, mm';
COMMENT ON COLUMN measured_distance.changed IS 'whether it is surely another than the model''s';

CREATE TABLE unexplained (
    run_id BIGINT NOT NULL,
    unexplained_no INTEGER NOT NULL,
    camera TEXT NOT NULL,
    kind TEXT NOT NULL,
    image_arc_no INTEGER,
    region_no INTEGER,
    u0 DOUBLE PRECISION NOT NULL,
    v0 DOUBLE PRECISION NOT NULL,
    u1 DOUBLE PRECISION NOT NULL,
    v1 DOUBLE PRECISION NOT NULL,
    length DOUBLE PRECISION NOT NULL,
    contrast DOUBLE PRECISION NOT NULL,
    beyond BOOLEAN NOT NULL,
    PRIMARY KEY (run_id, unexplained_no),
    CHECK (kind IN ('closed', 'curved', 'straight', 'region')),
    CHECK ((kind = 'region') = (region_no IS NOT NULL) AND (kind = 'region') = (image_arc_no IS NULL)),
    CHECK (u0 <= u1 AND v0 <= v1 AND length > 0)
);
COMMENT ON TABLE unexplained IS 'What a picture shows where the model shows nothing: arcs that form something and belong to no predicted edge, and regions that most of their border surrounds with such; texture is left out.';
COMMENT ON COLUMN unexplained.run_id IS 'the run';
COMMENT ON COLUMN unexplained.unexplained_no IS 'ordinal in the run, from 0, the most telling first';
COMMENT ON COLUMN unexplained.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN unexplained.kind IS 'closed, curved or straight, of an arc, or region';
COMMENT ON COLUMN unexplained.image_arc_no IS 'the arc in the extraction of that camera''s picture; null of a region';
COMMENT ON COLUMN unexplained.region_no IS 'the region in that extraction; null of an arc';
COMMENT ON COLUMN unexplained.u0 IS 'least x of it, px';
COMMENT ON COLUMN unexplained.v0 IS 'least y of it, px';
COMMENT ON COLUMN unexplained.u1 IS 'greatest x of it, px';
COMMENT ON COLUMN unexplained.v1 IS 'greatest y of it, px';
COMMENT ON COLUMN unexplained.length IS 'length, px; of a region that of its border along unexplained arcs';
COMMENT ON COLUMN unexplained.contrast IS 'mean height of the step along it, grey levels of 0..255';
COMMENT ON COLUMN unexplained.beyond IS 'whether most of it lies where the model shows nothing at all';

CREATE TABLE seen_through (
    run_id BIGINT NOT NULL,
    item_no INTEGER NOT NULL,
    camera TEXT NOT NULL,
    image_region_no INTEGER NOT NULL,
    pixels DOUBLE PRECISION NOT NULL,
    grey DOUBLE PRECISION NOT NULL,
    behind_grey DOUBLE PRECISION NOT NULL,
    behind_sigma DOUBLE PRECISION NOT NULL,
    stopped BOOLEAN NOT NULL,
    PRIMARY KEY (run_id, item_no, camera),
    CHECK (pixels > 0 AND behind_sigma > 0)
);
COMMENT ON TABLE seen_through IS 'Holes through which the model shows nothing, and the one region of a picture that fills them: what lies behind the object, or what stops them.';
COMMENT ON COLUMN seen_through.run_id IS 'the run';
COMMENT ON COLUMN seen_through.item_no IS 'the item';
COMMENT ON COLUMN seen_through.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN seen_through.image_region_no IS 'the region in the extraction of that camera''s picture';
COMMENT ON COLUMN seen_through.pixels IS 'its area, px';
COMMENT ON COLUMN seen_through.grey IS 'its mean grey, 0..255';
COMMENT ON COLUMN seen_through.behind_grey IS 'mean grey of the other regions where the model shows nothing, the nearer the more';
COMMENT ON COLUMN seen_through.behind_sigma IS 'standard deviation of one such region from that';
COMMENT ON COLUMN seen_through.stopped IS 'whether all cameras together tell that something else is seen than what lies behind';

CREATE TABLE variant_evidence (
    run_id BIGINT NOT NULL,
    rank_no INTEGER NOT NULL,
    object_no INTEGER NOT NULL,
    object_variant_id BIGINT NOT NULL,
    placed BOOLEAN NOT NULL,
    log_odds DOUBLE PRECISION NOT NULL,
    against INTEGER NOT NULL,
    decided INTEGER NOT NULL,
    PRIMARY KEY (run_id, rank_no),
    UNIQUE (run_id, object_no, object_variant_id),
    CHECK (against >= 0 AND against <= decided)
);
COMMENT ON TABLE variant_evidence IS 'What the pictures say at the pose found of each loaded variant of an inspected object, where something is not as the model says or it was asked for.';
COMMENT ON COLUMN variant_evidence.run_id IS 'the run';
COMMENT ON COLUMN variant_evidence.rank_no IS 'ordinal in the run, from 0: by object, the likeliest variant first';
COMMENT ON COLUMN variant_evidence.object_no IS 'the object of the run''s world in whose place the variant is weighed';
COMMENT ON COLUMN variant_evidence.object_variant_id IS 'the variant';
COMMENT ON COLUMN variant_evidence.placed IS 'whether it is the one that the world has there';
COMMENT ON COLUMN variant_evidence.log_odds IS 'natural logarithm of the odds of its visible edges, of each there against not there, summed';
COMMENT ON COLUMN variant_evidence.against IS 'how many of its parts and features in view are not as it has them';
COMMENT ON COLUMN variant_evidence.decided IS 'of how many that are decided';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('presence', 'localisation', 'primary'),
    ('presence_camera', 'localisation', 'primary'),
    ('measured_size', 'localisation', 'primary'),
    ('measured_distance', 'localisation', 'primary'),
    ('unexplained', 'localisation', 'primary'),
    ('seen_through', 'localisation', 'primary'),
    ('variant_evidence', 'localisation', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('presence', 0, ARRAY['run_id'], 'inspection', ARRAY['run_id']),
    ('presence_camera', 0, ARRAY['run_id', 'item_no'], 'presence', ARRAY['run_id', 'item_no']),
    ('measured_size', 0, ARRAY['run_id', 'item_no'], 'presence', ARRAY['run_id', 'item_no']),
    ('measured_distance', 0, ARRAY['run_id', 'item_no'], 'presence', ARRAY['run_id', 'item_no']),
    ('measured_distance', 1, ARRAY['run_id', 'other_item_no'], 'presence', ARRAY['run_id', 'item_no']),
    ('unexplained', 0, ARRAY['run_id', 'camera'], 'inspection_image', ARRAY['run_id', 'camera']),
    ('seen_through', 0, ARRAY['run_id', 'item_no'], 'presence', ARRAY['run_id', 'item_no']),
    ('variant_evidence', 0, ARRAY['run_id'], 'inspection', ARRAY['run_id']),
    ('variant_evidence', 1, ARRAY['object_variant_id'], 'object_variant', ARRAY['id']);
