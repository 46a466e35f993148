-- Level object: what differs between two loaded variants.

CREATE SEQUENCE variant_comparison_id_seq;
CREATE TABLE variant_comparison (
    id BIGINT PRIMARY KEY,
    run_id BIGINT NOT NULL,
    variant_a_id BIGINT NOT NULL,
    variant_b_id BIGINT NOT NULL,
    reach DOUBLE PRECISION NOT NULL,
    UNIQUE (variant_a_id, variant_b_id, reach)
);
COMMENT ON TABLE variant_comparison IS 'Pairs of loaded variants that were compared; made once, since a revision never changes.';
COMMENT ON COLUMN variant_comparison.id IS 'identity of the comparison';
COMMENT ON COLUMN variant_comparison.run_id IS 'the run that made it';
COMMENT ON COLUMN variant_comparison.variant_a_id IS 'the variant before';
COMMENT ON COLUMN variant_comparison.variant_b_id IS 'the variant after';
COMMENT ON COLUMN variant_comparison.reach IS 'how far a thing may move and still count as the same, mm';

CREATE TABLE variant_difference (
    comparison_id BIGINT NOT NULL,
    difference_no INTEGER NOT NULL,
    level TEXT NOT NULL,
    status TEXT NOT NULL,
    object_path_a TEXT,
    object_path_b TEXT,
    shape_a BIGINT,
    shape_b BIGINT,
    element_a INTEGER,
    element_b INTEGER,
    differs TEXT,
    dx DOUBLE PRECISION,
    dy DOUBLE PRECISION,
    dz DOUBLE PRECISION,
    distance DOUBLE PRECISION,
    angle DOUBLE PRECISION,
    PRIMARY KEY (comparison_id, difference_no),
    CHECK (level IN ('part', 'feature', 'surface')),
    CHECK (status IN ('identical', 'retrimmed', 'moved', 'changed', 'added', 'removed')),
    CHECK ((status = 'added') = (object_path_a IS NULL) OR level <> 'part'),
    CHECK ((status = 'removed') = (object_path_b IS NULL) OR level <> 'part'),
    CHECK ((status = 'added') = (element_a IS NULL) OR level = 'part'),
    CHECK ((status = 'removed') = (element_b IS NULL) OR level = 'part')
);
COMMENT ON TABLE variant_difference IS 'What became of each placed part, and of each feature and surface of the parts whose geometry changed.';
COMMENT ON COLUMN variant_difference.comparison_id IS 'the comparison';
COMMENT ON COLUMN variant_difference.difference_no IS 'ordinal: parts, then features, then surfaces';
COMMENT ON COLUMN variant_difference.level IS 'part, feature or surface';
COMMENT ON COLUMN variant_difference.status IS 'identical; retrimmed (same unbounded surfaces, other boundary); moved; changed (paired, other geometry); added; removed';
COMMENT ON COLUMN variant_difference.object_path_a IS 'path of the placed part before; of a feature or surface: of the first placed part that has it';
COMMENT ON COLUMN variant_difference.object_path_b IS 'path of the placed part after';
COMMENT ON COLUMN variant_difference.shape_a IS 'shape of the part before';
COMMENT ON COLUMN variant_difference.shape_b IS 'shape of the part after';
COMMENT ON COLUMN variant_difference.element_a IS 'feature_no or surface_no in shape_a';
COMMENT ON COLUMN variant_difference.element_b IS 'feature_no or surface_no in shape_b';
COMMENT ON COLUMN variant_difference.differs IS 'of parts: what differs besides geometry and place (path, number, name, material, colour, attributes, face labels); of changed features: the dimensions, before and after';
COMMENT ON COLUMN variant_difference.dx IS 'x of the displacement of the origin where moved or changed, mm; of parts in the object''s frame, of others in the shape''s';
COMMENT ON COLUMN variant_difference.dy IS 'y of the displacement, mm';
COMMENT ON COLUMN variant_difference.dz IS 'z of the displacement, mm';
COMMENT ON COLUMN variant_difference.distance IS 'length of the displacement, mm';
COMMENT ON COLUMN variant_difference.angle IS 'angle by which a part or feature turned, rad';

CREATE VIEW variant_change AS
SELECT
    d.comparison_id, a.name AS object_a, a.variant AS variant_a, b.name AS object_b, b.variant AS variant_b,
    d.level, d.status, d.object_path_a, d.object_path_b,
    coalesce(ka.kind, kb.kind, sa.recognised_kind, sb.recognised_kind) AS kind,
    coalesce(fa.name, ha.name) AS name_a, coalesce(fb.name, hb.name) AS name_b,
    d.element_a, d.element_b, d.differs, d.dx, d.dy, d.dz, d.distance, d.angle,
    coalesce((fb.x0 + fb.x1) / 2, sb.centroid_x, (fa.x0 + fa.x1) / 2, sa.centroid_x) AS x,
    coalesce((fb.y0 + fb.y1) / 2, sb.centroid_y, (fa.y0 + fa.y1) / 2, sa.centroid_y) AS y,
    coalesce((fb.z0 + fb.z1) / 2, sb.centroid_z, (fa.z0 + fa.z1) / 2, sa.centroid_z) AS z
FROM variant_difference AS d
JOIN variant_comparison AS c ON c.id = d.comparison_id
JOIN object_variant AS a ON a.id = c.variant_a_id
JOIN object_variant AS b ON b.id = c.variant_b_id
LEFT JOIN feature AS fa ON d.level = 'feature' AND fa.shape_id = d.shape_a AND fa.feature_no = d.element_a
LEFT JOIN feature_class AS ka ON ka.id = fa.feature_class_id
LEFT JOIN feature AS fb ON d.level = 'feature' AND fb.shape_id = d.shape_b AND fb.feature_no = d.element_b
LEFT JOIN feature_class AS kb ON kb.id = fb.feature_class_id
LEFT JOIN shape_surface AS ha ON d.level = 'surface' AND ha.shape_id = d.shape_a AND ha.surface_no = d.element_a
LEFT JOIN surface AS sa ON sa.id = ha.surface_id
LEFT JOIN shape_surface AS hb ON d.level = 'surface' AND hb.shape_id = d.shape_b AND hb.surface_no = d.element_b
LEFT JOIN surface AS sb ON sb.id = hb.surface_id;
COMMENT ON VIEW variant_change IS 'What became of parts, features and surfaces between two variants, with names, kinds and places.';
COMMENT ON COLUMN variant_change.comparison_id IS 'the comparison';
COMMENT ON COLUMN variant_change.object_a IS 'name of the object before';
COMMENT ON COLUMN variant_change.variant_a IS 'its variant';
COMMENT ON COLUMN variant_change.object_b IS 'name of the object after';
COMMENT ON COLUMN variant_change.variant_b IS 'its variant';
COMMENT ON COLUMN variant_change.level IS 'part, feature or surface';
COMMENT ON COLUMN variant_change.status IS 'identical, retrimmed, moved, changed, added or removed';
COMMENT ON COLUMN variant_change.object_path_a IS 'path of the placed part before';
COMMENT ON COLUMN variant_change.object_path_b IS 'path of the placed part after';
COMMENT ON COLUMN variant_change.kind IS 'kind of the feature or surface';
COMMENT ON COLUMN variant_change.name_a IS 'name of the feature or surface before';
COMMENT ON COLUMN variant_change.name_b IS 'name of the feature or surface after';
COMMENT ON COLUMN variant_change.element_a IS 'feature_no or surface_no before';
COMMENT ON COLUMN variant_change.element_b IS 'feature_no or surface_no after';
COMMENT ON COLUMN variant_change.differs IS 'of parts: what differs besides geometry and place; of changed features: the dimensions, before and after';
COMMENT ON COLUMN variant_change.dx IS 'x of the displacement where moved or changed, mm';
COMMENT ON COLUMN variant_change.dy IS 'y of the displacement, mm';
COMMENT ON COLUMN variant_change.dz IS 'z of the displacement, mm';
COMMENT ON COLUMN variant_change.distance IS 'length of the displacement, mm';
COMMENT ON COLUMN variant_change.angle IS 'angle by which it turned, rad';
COMMENT ON COLUMN variant_change.x IS 'x of its middle in the shape''s frame: after, or before where removed, mm';
COMMENT ON COLUMN variant_change.y IS 'y of its middle, mm';
COMMENT ON COLUMN variant_change.z IS 'z of its middle, mm';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('variant_comparison', 'object', 'primary'),
    ('variant_difference', 'object', 'redundant'),
    ('variant_change', 'object', 'view');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('variant_comparison', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('variant_comparison', 1, ARRAY['variant_a_id'], 'object_variant', ARRAY['id']),
    ('variant_comparison', 2, ARRAY['variant_b_id'], 'object_variant', ARRAY['id']),
    ('variant_difference', 0, ARRAY['comparison_id'], 'variant_comparison', ARRAY['id']),
    ('variant_difference', 1, ARRAY['shape_a'], 'shape', ARRAY['id']),
    ('variant_difference', 2, ARRAY['shape_b'], 'shape', ARRAY['id']);
