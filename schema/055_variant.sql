-- Level object: what differs between two loaded variants.

CREATE SEQUENCE variant_comparison_id_seq;
CREATE TABLE variant_comparison (  -- object: Pairs of loaded variants that were compared; made once, since a revision never changes.
    id BIGINT PRIMARY KEY,  -- identity of the comparison
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that made it
    variant_a_id BIGINT NOT NULL,  -- REFERENCES object_variant (id): the variant before
    variant_b_id BIGINT NOT NULL,  -- REFERENCES object_variant (id): the variant after
    reach DOUBLE PRECISION NOT NULL,  -- how far a thing may move and still count as the same, mm
    UNIQUE (variant_a_id, variant_b_id, reach)
);

CREATE TABLE variant_difference (  -- object, redundant: What became of each placed part, and of each feature and surface of the parts whose geometry changed.
    comparison_id BIGINT NOT NULL,  -- REFERENCES variant_comparison (id): the comparison
    difference_no INTEGER NOT NULL,  -- ordinal: parts, then features, then surfaces
    level TEXT NOT NULL,  -- part, feature or surface
    status TEXT NOT NULL,  -- identical; retrimmed (same unbounded surfaces, other boundary); moved; changed (paired, other geometry); added; removed
    object_path_a TEXT,  -- path of the placed part before; of a feature or surface: of the first placed part that has it
    object_path_b TEXT,  -- path of the placed part after
    shape_a BIGINT,  -- REFERENCES shape (id): shape of the part before
    shape_b BIGINT,  -- REFERENCES shape (id): shape of the part after
    element_a INTEGER,  -- feature_no or surface_no in shape_a
    element_b INTEGER,  -- feature_no or surface_no in shape_b
    differs TEXT,  -- of parts: what else differs (path, number, name, material, colour, attributes, face labels); of changed
        -- features: the dimensions, before and after
    dx DOUBLE PRECISION,  -- x of the displacement of the origin where moved or changed, mm; of parts in the object's frame, of others in the shape's
    dy DOUBLE PRECISION,  -- y of the displacement, mm
    dz DOUBLE PRECISION,  -- z of the displacement, mm
    distance DOUBLE PRECISION,  -- length of the displacement, mm
    angle DOUBLE PRECISION,  -- angle by which a part or feature turned, rad
    PRIMARY KEY (comparison_id, difference_no),
    CHECK (level IN ('part', 'feature', 'surface')),
    CHECK (status IN ('identical', 'retrimmed', 'moved', 'changed', 'added', 'removed')),
    CHECK ((status = 'added') = (object_path_a IS NULL) OR level <> 'part'),
    CHECK ((status = 'removed') = (object_path_b IS NULL) OR level <> 'part'),
    CHECK ((status = 'added') = (element_a IS NULL) OR level = 'part'),
    CHECK ((status = 'removed') = (element_b IS NULL) OR level = 'part')
);

CREATE VIEW variant_change (  -- object: What became of parts, features and surfaces between two variants, with names, kinds and places.
    comparison_id,  -- the comparison
    object_a,  -- name of the object before
    variant_a,  -- its variant
    object_b,  -- name of the object after
    variant_b,  -- its variant
    level,  -- part, feature or surface
    status,  -- identical, retrimmed, moved, changed, added or removed
    object_path_a,  -- path of the placed part before
    object_path_b,  -- path of the placed part after
    kind,  -- kind of the feature or surface
    name_a,  -- name of the feature or surface before
    name_b,  -- name of the feature or surface after
    element_a,  -- feature_no or surface_no before
    element_b,  -- feature_no or surface_no after
    differs,  -- of parts: what else differs; of changed features: the dimensions, before and after
    dx,  -- x of the displacement where moved or changed, mm
    dy,  -- y of the displacement, mm
    dz,  -- z of the displacement, mm
    distance,  -- length of the displacement, mm
    angle,  -- angle by which it turned, rad
    x,  -- x of its middle in the shape's frame: after, or before where removed, mm
    y,  -- y of its middle, mm
    z  -- z of its middle, mm
) AS
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
