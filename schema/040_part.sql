-- Level part: products, and the shapes (geometry) that they have; relations of the surfaces and arcs of a shape.

CREATE SEQUENCE shape_id_seq;
CREATE TABLE shape (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE,
    kind TEXT NOT NULL,
    surface_count INTEGER NOT NULL,
    arc_count INTEGER NOT NULL,
    area DOUBLE PRECISION NOT NULL,
    volume DOUBLE PRECISION,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK (kind IN ('solid', 'sheet', 'wire', 'mesh'))
);
COMMENT ON TABLE shape IS 'A piece of geometry in its own frame, addressed by content: two parts may share one.';
COMMENT ON COLUMN shape.id IS 'identity of the shape';
COMMENT ON COLUMN shape.content_key IS 'hash of its surfaces and arcs: equal shapes are one row';
COMMENT ON COLUMN shape.kind IS 'solid, sheet, wire (supplemental geometry), mesh';
COMMENT ON COLUMN shape.surface_count IS 'number of surfaces';
COMMENT ON COLUMN shape.arc_count IS 'number of arcs';
COMMENT ON COLUMN shape.area IS 'sum of the surfaces'' areas, mm2';
COMMENT ON COLUMN shape.volume IS 'enclosed volume, mm3; null where not closed';
COMMENT ON COLUMN shape.x0 IS 'least x of the shape''s bounding box in its own frame, mm';
COMMENT ON COLUMN shape.y0 IS 'least y of the shape''s bounding box in its own frame, mm';
COMMENT ON COLUMN shape.z0 IS 'least z of the shape''s bounding box in its own frame, mm';
COMMENT ON COLUMN shape.x1 IS 'greatest x of the shape''s bounding box in its own frame, mm';
COMMENT ON COLUMN shape.y1 IS 'greatest y of the shape''s bounding box in its own frame, mm';
COMMENT ON COLUMN shape.z1 IS 'greatest z of the shape''s bounding box in its own frame, mm';

CREATE TABLE shape_surface (
    shape_id BIGINT NOT NULL,
    surface_no INTEGER NOT NULL,
    surface_id BIGINT NOT NULL,
    name TEXT,
    PRIMARY KEY (shape_id, surface_no)
);
COMMENT ON TABLE shape_surface IS 'The surfaces of a shape.';
COMMENT ON COLUMN shape_surface.shape_id IS 'the shape';
COMMENT ON COLUMN shape_surface.surface_no IS 'ordinal of the surface in the shape, from 0';
COMMENT ON COLUMN shape_surface.surface_id IS 'the surface';
COMMENT ON COLUMN shape_surface.name IS 'name of the face in the source';

CREATE TABLE shape_arc (
    shape_id BIGINT NOT NULL,
    arc_no INTEGER NOT NULL,
    arc_id BIGINT NOT NULL,
    surface_a INTEGER,
    surface_b INTEGER,
    convexity TEXT NOT NULL,
    angle DOUBLE PRECISION,
    PRIMARY KEY (shape_id, arc_no),
    CHECK (convexity IN ('convex', 'concave', 'smooth', 'seam', 'free', 'degenerate'))
);
COMMENT ON TABLE shape_arc IS 'The arcs of a shape, with the surfaces they separate.';
COMMENT ON COLUMN shape_arc.shape_id IS 'the shape';
COMMENT ON COLUMN shape_arc.arc_no IS 'ordinal of the arc in the shape, from 0';
COMMENT ON COLUMN shape_arc.arc_id IS 'the arc';
COMMENT ON COLUMN shape_arc.surface_a IS 'surface_no of the surface whose coedge runs along the arc';
COMMENT ON COLUMN shape_arc.surface_b IS 'surface_no of the surface whose coedge runs against it; equal to surface_a at a seam, null at a free edge';
COMMENT ON COLUMN shape_arc.convexity IS 'convex, concave, smooth (|angle| < 1 degree), seam, free, or degenerate';
COMMENT ON COLUMN shape_arc.angle IS 'dihedral angle at mid-arc: atan2((na x nb).t, na.nb), t along the coedge of surface_a; positive convex, rad';

CREATE TABLE shape_mesh (
    shape_id BIGINT PRIMARY KEY,
    chord_mm DOUBLE PRECISION NOT NULL,
    chord_rad DOUBLE PRECISION NOT NULL,
    deviation_mm DOUBLE PRECISION,
    vertices DOUBLE PRECISION[] NOT NULL,
    normals REAL[] NOT NULL,
    triangles INTEGER[] NOT NULL,
    triangle_surfaces INTEGER[] NOT NULL
);
COMMENT ON TABLE shape_mesh IS 'Triangles of a shape for casting rays and drawing; vertices are apart for each surface.';
COMMENT ON COLUMN shape_mesh.shape_id IS 'the shape';
COMMENT ON COLUMN shape_mesh.chord_mm IS 'distance of triangles from the surface that was asked for, mm';
COMMENT ON COLUMN shape_mesh.chord_rad IS 'angle between neighbouring normals that was asked for, rad';
COMMENT ON COLUMN shape_mesh.deviation_mm IS 'greatest measured distance between triangles and the exact geometry, mm; null where it is not known';
COMMENT ON COLUMN shape_mesh.vertices IS 'vertices, x y z after each other, mm';
COMMENT ON COLUMN shape_mesh.normals IS 'outward unit normals of the exact surface at the vertices';
COMMENT ON COLUMN shape_mesh.triangles IS 'vertex ordinals, three a triangle, counter-clockwise from outside';
COMMENT ON COLUMN shape_mesh.triangle_surfaces IS 'surface_no of each triangle';

CREATE TABLE shape_arc_sample (
    shape_id BIGINT NOT NULL,
    arc_no INTEGER NOT NULL,
    parameters DOUBLE PRECISION[] NOT NULL,
    points DOUBLE PRECISION[] NOT NULL,
    tangents REAL[] NOT NULL,
    normals_a REAL[] NOT NULL,
    normals_b REAL[] NOT NULL,
    PRIMARY KEY (shape_id, arc_no)
);
COMMENT ON TABLE shape_arc_sample IS 'Points along the arcs of a shape with the normals on both sides, for prediction of views.';
COMMENT ON COLUMN shape_arc_sample.shape_id IS 'the shape';
COMMENT ON COLUMN shape_arc_sample.arc_no IS 'the arc';
COMMENT ON COLUMN shape_arc_sample.parameters IS 'parameter t of each point';
COMMENT ON COLUMN shape_arc_sample.points IS 'points, x y z after each other, mm';
COMMENT ON COLUMN shape_arc_sample.tangents IS 'unit tangents towards growing t';
COMMENT ON COLUMN shape_arc_sample.normals_a IS 'outward unit normals of surface_a at the points';
COMMENT ON COLUMN shape_arc_sample.normals_b IS 'outward unit normals of surface_b; those of surface_a turned round where there is none (a free edge)';

CREATE TABLE surface_adjacency (
    shape_id BIGINT NOT NULL,
    arc_no INTEGER NOT NULL,
    surface_a INTEGER NOT NULL,
    surface_b INTEGER NOT NULL,
    convexity TEXT NOT NULL,
    angle DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (shape_id, arc_no),
    CHECK (surface_a < surface_b)
);
COMMENT ON TABLE surface_adjacency IS 'Which surfaces of a shape meet along which arc.';
COMMENT ON COLUMN surface_adjacency.shape_id IS 'the shape';
COMMENT ON COLUMN surface_adjacency.arc_no IS 'the common arc';
COMMENT ON COLUMN surface_adjacency.surface_a IS 'one surface';
COMMENT ON COLUMN surface_adjacency.surface_b IS 'the other, greater than surface_a';
COMMENT ON COLUMN surface_adjacency.convexity IS 'convex, concave or smooth';
COMMENT ON COLUMN surface_adjacency.angle IS 'dihedral angle, positive convex, rad';

CREATE TABLE surface_relation (
    shape_id BIGINT NOT NULL,
    kind TEXT NOT NULL,
    surface_a INTEGER NOT NULL,
    surface_b INTEGER NOT NULL,
    value DOUBLE PRECISION,
    tolerance DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (shape_id, kind, surface_a, surface_b)
);
COMMENT ON TABLE surface_relation IS 'Geometric relations of two surfaces of a shape.';
COMMENT ON COLUMN surface_relation.shape_id IS 'the shape';
COMMENT ON COLUMN surface_relation.kind IS 'parallel, perpendicular, coplanar, coaxial, concentric, equal_radius, tangent';
COMMENT ON COLUMN surface_relation.surface_a IS 'one surface';
COMMENT ON COLUMN surface_relation.surface_b IS 'the other';
COMMENT ON COLUMN surface_relation.value IS 'measured value: distance of parallel planes or axes (mm), radius (mm), angle off (rad)';
COMMENT ON COLUMN surface_relation.tolerance IS 'tolerance within which the relation was taken to hold, in the value''s unit';

CREATE TABLE arc_relation (
    shape_id BIGINT NOT NULL,
    kind TEXT NOT NULL,
    arc_a INTEGER NOT NULL,
    arc_b INTEGER NOT NULL,
    value DOUBLE PRECISION,
    tolerance DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (shape_id, kind, arc_a, arc_b)
);
COMMENT ON TABLE arc_relation IS 'Geometric relations of two arcs of a shape.';
COMMENT ON COLUMN arc_relation.shape_id IS 'the shape';
COMMENT ON COLUMN arc_relation.kind IS 'parallel, collinear, concentric, equal_radius, meets, tangent';
COMMENT ON COLUMN arc_relation.arc_a IS 'one arc';
COMMENT ON COLUMN arc_relation.arc_b IS 'the other';
COMMENT ON COLUMN arc_relation.value IS 'measured value: distance (mm), radius (mm), angle (rad)';
COMMENT ON COLUMN arc_relation.tolerance IS 'tolerance within which the relation was taken to hold, in the value''s unit';

CREATE SEQUENCE feature_class_id_seq;
CREATE TABLE feature_class (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE,
    kind TEXT NOT NULL
);
COMMENT ON TABLE feature_class IS 'Congruent features: a kind with its dimensions and the form of its outline, in a frame of its own; mirror images are two.';
COMMENT ON COLUMN feature_class.id IS 'identity of the class';
COMMENT ON COLUMN feature_class.content_key IS 'hash of kind, dimensions and form';
COMMENT ON COLUMN feature_class.kind IS 'through_hole, blind_hole, pocket, slot, open_slot, step, duct, rib, flange, web, boss, lug, fillet, chamfer, groove, circular_pattern, linear_pattern, grid_pattern, body';

CREATE TABLE feature_dimension (
    feature_class_id BIGINT NOT NULL,
    name TEXT NOT NULL,
    value DOUBLE PRECISION NOT NULL,
    unit TEXT NOT NULL,
    PRIMARY KEY (feature_class_id, name)
);
COMMENT ON TABLE feature_dimension IS 'Attribute-value table of feature classes: their dimensions.';
COMMENT ON COLUMN feature_dimension.feature_class_id IS 'the class';
COMMENT ON COLUMN feature_dimension.name IS 'diameter, depth, width, length, corner_radius, ...';
COMMENT ON COLUMN feature_dimension.value IS 'the dimension';
COMMENT ON COLUMN feature_dimension.unit IS 'mm, rad, or 1 of a count';

CREATE TABLE feature (
    shape_id BIGINT NOT NULL,
    feature_no INTEGER NOT NULL,
    feature_class_id BIGINT NOT NULL,
    name TEXT NOT NULL,
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
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (shape_id, feature_no)
);
COMMENT ON TABLE feature IS 'A feature of a shape: a class placed by a transform.';
COMMENT ON COLUMN feature.shape_id IS 'the shape';
COMMENT ON COLUMN feature.feature_no IS 'ordinal of the feature in the shape, from 0';
COMMENT ON COLUMN feature.feature_class_id IS 'its class';
COMMENT ON COLUMN feature.name IS 'name in the source, or kind and ordinal';
COMMENT ON COLUMN feature.m00 IS 'shape_from_feature: row 0, column 0 of the rotation';
COMMENT ON COLUMN feature.m01 IS 'shape_from_feature: row 0, column 1 of the rotation';
COMMENT ON COLUMN feature.m02 IS 'shape_from_feature: row 0, column 2 of the rotation';
COMMENT ON COLUMN feature.m03 IS 'shape_from_feature: row 0 of the translation, mm';
COMMENT ON COLUMN feature.m10 IS 'shape_from_feature: row 1, column 0 of the rotation';
COMMENT ON COLUMN feature.m11 IS 'shape_from_feature: row 1, column 1 of the rotation';
COMMENT ON COLUMN feature.m12 IS 'shape_from_feature: row 1, column 2 of the rotation';
COMMENT ON COLUMN feature.m13 IS 'shape_from_feature: row 1 of the translation, mm';
COMMENT ON COLUMN feature.m20 IS 'shape_from_feature: row 2, column 0 of the rotation';
COMMENT ON COLUMN feature.m21 IS 'shape_from_feature: row 2, column 1 of the rotation';
COMMENT ON COLUMN feature.m22 IS 'shape_from_feature: row 2, column 2 of the rotation';
COMMENT ON COLUMN feature.m23 IS 'shape_from_feature: row 2 of the translation, mm';
COMMENT ON COLUMN feature.x0 IS 'least x of the feature''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN feature.y0 IS 'least y of the feature''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN feature.z0 IS 'least z of the feature''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN feature.x1 IS 'greatest x of the feature''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN feature.y1 IS 'greatest y of the feature''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN feature.z1 IS 'greatest z of the feature''s bounding box in the shape''s frame, mm';

CREATE TABLE feature_surface (
    shape_id BIGINT NOT NULL,
    feature_no INTEGER NOT NULL,
    surface_no INTEGER NOT NULL,
    role TEXT NOT NULL,
    PRIMARY KEY (shape_id, feature_no, surface_no)
);
COMMENT ON TABLE feature_surface IS 'The surfaces that make a feature.';
COMMENT ON COLUMN feature_surface.shape_id IS 'the shape';
COMMENT ON COLUMN feature_surface.feature_no IS 'the feature';
COMMENT ON COLUMN feature_surface.surface_no IS 'the surface';
COMMENT ON COLUMN feature_surface.role IS 'wall, floor, blend, side, bore, hole, body, ...';

CREATE TABLE shape_box (
    shape_id BIGINT NOT NULL,
    level TEXT NOT NULL,
    element_no INTEGER NOT NULL,
    page INTEGER NOT NULL,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (shape_id, level, element_no),
    CHECK (level IN ('feature', 'surface', 'arc'))
);
COMMENT ON TABLE shape_box IS 'Boxes of the features, surfaces and arcs of a shape in its own frame, packed into pages of an R-tree.';
COMMENT ON COLUMN shape_box.shape_id IS 'the shape';
COMMENT ON COLUMN shape_box.level IS 'feature, surface or arc';
COMMENT ON COLUMN shape_box.element_no IS 'feature_no, surface_no or arc_no';
COMMENT ON COLUMN shape_box.page IS 'page of shape_box_page';
COMMENT ON COLUMN shape_box.x0 IS 'least x of the element''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box.y0 IS 'least y of the element''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box.z0 IS 'least z of the element''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box.x1 IS 'greatest x of the element''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box.y1 IS 'greatest y of the element''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box.z1 IS 'greatest z of the element''s bounding box in the shape''s frame, mm';

CREATE TABLE shape_box_page (
    shape_id BIGINT NOT NULL,
    level TEXT NOT NULL,
    page INTEGER NOT NULL,
    box_count INTEGER NOT NULL,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (shape_id, level, page)
);
COMMENT ON TABLE shape_box_page IS 'Pages of shape_box: the union of their boxes.';
COMMENT ON COLUMN shape_box_page.shape_id IS 'the shape';
COMMENT ON COLUMN shape_box_page.level IS 'feature, surface or arc';
COMMENT ON COLUMN shape_box_page.page IS 'the page';
COMMENT ON COLUMN shape_box_page.box_count IS 'number of boxes in the page';
COMMENT ON COLUMN shape_box_page.x0 IS 'least x of the page''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box_page.y0 IS 'least y of the page''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box_page.z0 IS 'least z of the page''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box_page.x1 IS 'greatest x of the page''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box_page.y1 IS 'greatest y of the page''s bounding box in the shape''s frame, mm';
COMMENT ON COLUMN shape_box_page.z1 IS 'greatest z of the page''s bounding box in the shape''s frame, mm';

CREATE SEQUENCE part_id_seq;
CREATE TABLE part (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE,
    number TEXT NOT NULL,
    name TEXT NOT NULL,
    shape_id BIGINT NOT NULL,
    supplemental BOOLEAN NOT NULL
);
COMMENT ON TABLE part IS 'A product: number, name, and the shape it has; material, colour and the like are its attributes.';
COMMENT ON COLUMN part.id IS 'identity of the part';
COMMENT ON COLUMN part.content_key IS 'hash of number, name, attributes and shape: equal parts are one row';
COMMENT ON COLUMN part.number IS 'part number in the source';
COMMENT ON COLUMN part.name IS 'name in the source';
COMMENT ON COLUMN part.shape_id IS 'its geometry';
COMMENT ON COLUMN part.supplemental IS 'whether it is construction geometry, reference geometry or drawn annotation of a product: kept, but not material, so never placed in a world nor matched';

CREATE TABLE part_attribute (
    part_id BIGINT NOT NULL,
    name TEXT NOT NULL,
    run_id BIGINT NOT NULL,
    value_number DOUBLE PRECISION,
    value_text TEXT,
    value_boolean BOOLEAN,
    unit TEXT,
    source TEXT NOT NULL,
    PRIMARY KEY (part_id, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);
COMMENT ON TABLE part_attribute IS 'Attribute-value table of parts; appended to, never changed: current_part_attribute has the newest value of each.';
COMMENT ON COLUMN part_attribute.part_id IS 'the part';
COMMENT ON COLUMN part_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN part_attribute.run_id IS 'the run that stated it: the greatest has the newest value';
COMMENT ON COLUMN part_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN part_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN part_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN part_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN part_attribute.source IS 'where the value comes from: file, derived, user';

CREATE VIEW current_part_attribute AS
SELECT DISTINCT ON (part_id, name) part_id, name, value_number, value_text, value_boolean, unit, source, run_id
FROM part_attribute
ORDER BY part_id, name, run_id DESC;
COMMENT ON VIEW current_part_attribute IS 'The newest value of each attribute of parts.';
COMMENT ON COLUMN current_part_attribute.part_id IS 'the part';
COMMENT ON COLUMN current_part_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN current_part_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN current_part_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN current_part_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN current_part_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN current_part_attribute.source IS 'where the value comes from: file, derived, user';
COMMENT ON COLUMN current_part_attribute.run_id IS 'the run that stated it';

CREATE TABLE surface_attribute (
    shape_id BIGINT NOT NULL,
    surface_no INTEGER NOT NULL,
    name TEXT NOT NULL,
    run_id BIGINT NOT NULL,
    value_number DOUBLE PRECISION,
    value_text TEXT,
    value_boolean BOOLEAN,
    unit TEXT,
    source TEXT NOT NULL,
    PRIMARY KEY (shape_id, surface_no, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);
COMMENT ON TABLE surface_attribute IS 'Attribute-value table of the surfaces of a shape; appended to, never changed: current_surface_attribute has the newest value of each.';
COMMENT ON COLUMN surface_attribute.shape_id IS 'the shape: what parts share it share the value';
COMMENT ON COLUMN surface_attribute.surface_no IS 'the surface in it';
COMMENT ON COLUMN surface_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN surface_attribute.run_id IS 'the run that stated it: the greatest has the newest value';
COMMENT ON COLUMN surface_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN surface_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN surface_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN surface_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN surface_attribute.source IS 'where the value comes from: file, derived, user';

CREATE VIEW current_surface_attribute AS
SELECT DISTINCT ON (shape_id, surface_no, name) shape_id, surface_no, name, value_number, value_text, value_boolean, unit, source, run_id
FROM surface_attribute
ORDER BY shape_id, surface_no, name, run_id DESC;
COMMENT ON VIEW current_surface_attribute IS 'The newest value of each attribute of the surfaces of a shape.';
COMMENT ON COLUMN current_surface_attribute.shape_id IS 'the shape: what parts share it share the value';
COMMENT ON COLUMN current_surface_attribute.surface_no IS 'the surface in it';
COMMENT ON COLUMN current_surface_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN current_surface_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN current_surface_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN current_surface_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN current_surface_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN current_surface_attribute.source IS 'where the value comes from: file, derived, user';
COMMENT ON COLUMN current_surface_attribute.run_id IS 'the run that stated it';

CREATE TABLE arc_attribute (
    shape_id BIGINT NOT NULL,
    arc_no INTEGER NOT NULL,
    name TEXT NOT NULL,
    run_id BIGINT NOT NULL,
    value_number DOUBLE PRECISION,
    value_text TEXT,
    value_boolean BOOLEAN,
    unit TEXT,
    source TEXT NOT NULL,
    PRIMARY KEY (shape_id, arc_no, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);
COMMENT ON TABLE arc_attribute IS 'Attribute-value table of the arcs of a shape; appended to, never changed: current_arc_attribute has the newest value of each.';
COMMENT ON COLUMN arc_attribute.shape_id IS 'the shape: what parts share it share the value';
COMMENT ON COLUMN arc_attribute.arc_no IS 'the arc in it';
COMMENT ON COLUMN arc_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN arc_attribute.run_id IS 'the run that stated it: the greatest has the newest value';
COMMENT ON COLUMN arc_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN arc_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN arc_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN arc_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN arc_attribute.source IS 'where the value comes from: file, derived, user';

CREATE VIEW current_arc_attribute AS
SELECT DISTINCT ON (shape_id, arc_no, name) shape_id, arc_no, name, value_number, value_text, value_boolean, unit, source, run_id
FROM arc_attribute
ORDER BY shape_id, arc_no, name, run_id DESC;
COMMENT ON VIEW current_arc_attribute IS 'The newest value of each attribute of the arcs of a shape.';
COMMENT ON COLUMN current_arc_attribute.shape_id IS 'the shape: what parts share it share the value';
COMMENT ON COLUMN current_arc_attribute.arc_no IS 'the arc in it';
COMMENT ON COLUMN current_arc_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN current_arc_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN current_arc_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN current_arc_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN current_arc_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN current_arc_attribute.source IS 'where the value comes from: file, derived, user';
COMMENT ON COLUMN current_arc_attribute.run_id IS 'the run that stated it';

CREATE VIEW part_mass AS
SELECT p.id AS part_id, p.number, s.volume, a.value_number * u.factor AS density,
    s.volume * 1e-9 * a.value_number * u.factor AS mass, a.source, a.run_id
FROM part AS p
JOIN shape AS s ON s.id = p.shape_id
JOIN current_part_attribute AS a ON a.part_id = p.id AND a.name = 'density'
JOIN unit_of_measure AS u ON u.symbol = a.unit AND u.dimension = 'density'
WHERE s.volume IS NOT NULL;
COMMENT ON VIEW part_mass IS 'Mass of one piece of each part that encloses a volume and whose density is known; placed_part has how many an object holds.';
COMMENT ON COLUMN part_mass.part_id IS 'the part';
COMMENT ON COLUMN part_mass.number IS 'its number';
COMMENT ON COLUMN part_mass.volume IS 'volume of its shape, mm3';
COMMENT ON COLUMN part_mass.density IS 'its density, kg/m3';
COMMENT ON COLUMN part_mass.mass IS 'volume times density, kg';
COMMENT ON COLUMN part_mass.source IS 'where the density comes from: file, derived, user';
COMMENT ON COLUMN part_mass.run_id IS 'the run that stated the density';

CREATE TABLE part_pmi (
    part_id BIGINT NOT NULL,
    pmi_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    type TEXT NOT NULL,
    name TEXT NOT NULL,
    value DOUBLE PRECISION,
    lower_limit DOUBLE PRECISION,
    upper_limit DOUBLE PRECISION,
    unit TEXT,
    stated_unit TEXT,
    modifier TEXT,
    zone TEXT,
    PRIMARY KEY (part_id, pmi_no),
    CHECK (kind IN ('dimension', 'tolerance', 'datum'))
);
COMMENT ON TABLE part_pmi IS 'Product and manufacturing information of a part: dimensions, geometric tolerances, datums.';
COMMENT ON COLUMN part_pmi.part_id IS 'the part';
COMMENT ON COLUMN part_pmi.pmi_no IS 'ordinal: dimensions, tolerances, datums, each in the order of the file';
COMMENT ON COLUMN part_pmi.kind IS 'dimension, tolerance or datum';
COMMENT ON COLUMN part_pmi.type IS 'of a dimension diameter, radius, linear distance, angle ...; of a tolerance position, flatness, surface profile ...; of a datum feature, target, or datum where the file shows neither';
COMMENT ON COLUMN part_pmi.name IS 'name in the file, or empty';
COMMENT ON COLUMN part_pmi.value IS 'nominal value of a dimension, width of a tolerance zone; null where the file gives none';
COMMENT ON COLUMN part_pmi.lower_limit IS 'least value that a dimension may have; null where it is not bounded';
COMMENT ON COLUMN part_pmi.upper_limit IS 'greatest value that a dimension may have; null where it is not bounded';
COMMENT ON COLUMN part_pmi.unit IS 'unit of value and limits: mm or rad';
COMMENT ON COLUMN part_pmi.stated_unit IS 'unit in the file';
COMMENT ON COLUMN part_pmi.modifier IS 'maximum or least material requirement, class of a fit, note, or shape and number of a datum target';
COMMENT ON COLUMN part_pmi.zone IS 'form of a tolerance zone, where the file gives one';

CREATE TABLE part_pmi_datum (
    part_id BIGINT NOT NULL,
    pmi_no INTEGER NOT NULL,
    precedence INTEGER NOT NULL,
    letter TEXT NOT NULL,
    modifier TEXT,
    PRIMARY KEY (part_id, pmi_no, precedence)
);
COMMENT ON TABLE part_pmi_datum IS 'Datums that a tolerance refers to; of a datum its own letter.';
COMMENT ON COLUMN part_pmi_datum.part_id IS 'the part';
COMMENT ON COLUMN part_pmi_datum.pmi_no IS 'the tolerance or datum';
COMMENT ON COLUMN part_pmi_datum.precedence IS '1 primary, 2 secondary, 3 tertiary';
COMMENT ON COLUMN part_pmi_datum.letter IS 'letter, or letters joined by - where several act as one';
COMMENT ON COLUMN part_pmi_datum.modifier IS 'such as maximum material requirement; null where there is none';

CREATE TABLE part_pmi_surface (
    part_id BIGINT NOT NULL,
    pmi_no INTEGER NOT NULL,
    shape_id BIGINT NOT NULL,
    surface_no INTEGER NOT NULL,
    role TEXT NOT NULL,
    PRIMARY KEY (part_id, pmi_no, surface_no),
    CHECK (role IN ('feature', 'origin', 'target'))
);
COMMENT ON TABLE part_pmi_surface IS 'Surfaces that a dimension, tolerance or datum is of.';
COMMENT ON COLUMN part_pmi_surface.part_id IS 'the part';
COMMENT ON COLUMN part_pmi_surface.pmi_no IS 'the dimension, tolerance or datum';
COMMENT ON COLUMN part_pmi_surface.shape_id IS 'the part''s shape';
COMMENT ON COLUMN part_pmi_surface.surface_no IS 'the surface in it';
COMMENT ON COLUMN part_pmi_surface.role IS 'feature; of a distance or angle between two, origin or target';

CREATE VIEW surface_pmi AS
SELECT f.part_id, f.shape_id, f.surface_no, f.role, m.pmi_no, m.kind, m.type, m.name, m.value, m.lower_limit, m.upper_limit,
    m.unit, m.modifier, m.zone, d.datums
FROM part_pmi_surface AS f
JOIN part_pmi AS m ON m.part_id = f.part_id AND m.pmi_no = f.pmi_no
LEFT JOIN (
    SELECT part_id, pmi_no, string_agg(letter, ', ' ORDER BY precedence) AS datums
    FROM part_pmi_datum
    GROUP BY part_id, pmi_no
) AS d ON d.part_id = f.part_id AND d.pmi_no = f.pmi_no;
COMMENT ON VIEW surface_pmi IS 'Dimensions, tolerances and datums by the surface that they are of.';
COMMENT ON COLUMN surface_pmi.part_id IS 'the part';
COMMENT ON COLUMN surface_pmi.shape_id IS 'the part''s shape';
COMMENT ON COLUMN surface_pmi.surface_no IS 'the surface in it';
COMMENT ON COLUMN surface_pmi.role IS 'feature; of a distance or angle between two, origin or target';
COMMENT ON COLUMN surface_pmi.pmi_no IS 'the dimension, tolerance or datum, as in part_pmi';
COMMENT ON COLUMN surface_pmi.kind IS 'dimension, tolerance or datum';
COMMENT ON COLUMN surface_pmi.type IS 'as in part_pmi: diameter, flatness, ...';
COMMENT ON COLUMN surface_pmi.name IS 'name in the file, or empty';
COMMENT ON COLUMN surface_pmi.value IS 'nominal value of a dimension, width of a tolerance zone';
COMMENT ON COLUMN surface_pmi.lower_limit IS 'least value that a dimension may have';
COMMENT ON COLUMN surface_pmi.upper_limit IS 'greatest value that a dimension may have';
COMMENT ON COLUMN surface_pmi.unit IS 'unit of value and limits: mm or rad';
COMMENT ON COLUMN surface_pmi.modifier IS 'as in part_pmi';
COMMENT ON COLUMN surface_pmi.zone IS 'form of a tolerance zone';
COMMENT ON COLUMN surface_pmi.datums IS 'letters of the datums that a tolerance refers to, the first of them first; of a datum its own';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('shape', 'part', 'primary'),
    ('shape_surface', 'part', 'primary'),
    ('shape_arc', 'part', 'primary'),
    ('shape_mesh', 'part', 'redundant'),
    ('shape_arc_sample', 'part', 'redundant'),
    ('surface_adjacency', 'part', 'redundant'),
    ('surface_relation', 'part', 'redundant'),
    ('arc_relation', 'part', 'redundant'),
    ('feature_class', 'part', 'primary'),
    ('feature_dimension', 'part', 'primary'),
    ('feature', 'part', 'primary'),
    ('feature_surface', 'part', 'primary'),
    ('shape_box', 'part', 'redundant'),
    ('shape_box_page', 'part', 'redundant'),
    ('part', 'part', 'primary'),
    ('part_attribute', 'part', 'primary'),
    ('current_part_attribute', 'part', 'view'),
    ('surface_attribute', 'surface', 'primary'),
    ('current_surface_attribute', 'surface', 'view'),
    ('arc_attribute', 'surface', 'primary'),
    ('current_arc_attribute', 'surface', 'view'),
    ('part_mass', 'part', 'view'),
    ('part_pmi', 'part', 'primary'),
    ('part_pmi_datum', 'part', 'primary'),
    ('part_pmi_surface', 'part', 'primary'),
    ('surface_pmi', 'surface', 'view');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('shape_surface', 0, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('shape_surface', 1, ARRAY['surface_id'], 'surface', ARRAY['id']),
    ('shape_arc', 0, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('shape_arc', 1, ARRAY['arc_id'], 'arc', ARRAY['id']),
    ('shape_arc', 2, ARRAY['shape_id', 'surface_a'], 'shape_surface', ARRAY['shape_id', 'surface_no']),
    ('shape_arc', 3, ARRAY['shape_id', 'surface_b'], 'shape_surface', ARRAY['shape_id', 'surface_no']),
    ('shape_mesh', 0, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('shape_arc_sample', 0, ARRAY['shape_id', 'arc_no'], 'shape_arc', ARRAY['shape_id', 'arc_no']),
    ('surface_adjacency', 0, ARRAY['shape_id', 'arc_no'], 'shape_arc', ARRAY['shape_id', 'arc_no']),
    ('surface_relation', 0, ARRAY['shape_id', 'surface_a'], 'shape_surface', ARRAY['shape_id', 'surface_no']),
    ('surface_relation', 1, ARRAY['shape_id', 'surface_b'], 'shape_surface', ARRAY['shape_id', 'surface_no']),
    ('arc_relation', 0, ARRAY['shape_id', 'arc_a'], 'shape_arc', ARRAY['shape_id', 'arc_no']),
    ('arc_relation', 1, ARRAY['shape_id', 'arc_b'], 'shape_arc', ARRAY['shape_id', 'arc_no']),
    ('feature_dimension', 0, ARRAY['feature_class_id'], 'feature_class', ARRAY['id']),
    ('feature', 0, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('feature', 1, ARRAY['feature_class_id'], 'feature_class', ARRAY['id']),
    ('feature_surface', 0, ARRAY['shape_id', 'feature_no'], 'feature', ARRAY['shape_id', 'feature_no']),
    ('feature_surface', 1, ARRAY['shape_id', 'surface_no'], 'shape_surface', ARRAY['shape_id', 'surface_no']),
    ('shape_box', 0, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('shape_box_page', 0, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('part', 0, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('part_attribute', 0, ARRAY['part_id'], 'part', ARRAY['id']),
    ('part_attribute', 1, ARRAY['run_id'], 'run', ARRAY['id']),
    ('surface_attribute', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('surface_attribute', 1, ARRAY['shape_id', 'surface_no'], 'shape_surface', ARRAY['shape_id', 'surface_no']),
    ('arc_attribute', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('arc_attribute', 1, ARRAY['shape_id', 'arc_no'], 'shape_arc', ARRAY['shape_id', 'arc_no']),
    ('part_pmi', 0, ARRAY['part_id'], 'part', ARRAY['id']),
    ('part_pmi_datum', 0, ARRAY['part_id', 'pmi_no'], 'part_pmi', ARRAY['part_id', 'pmi_no']),
    ('part_pmi_surface', 0, ARRAY['part_id', 'pmi_no'], 'part_pmi', ARRAY['part_id', 'pmi_no']),
    ('part_pmi_surface', 1, ARRAY['shape_id', 'surface_no'], 'shape_surface', ARRAY['shape_id', 'surface_no']);
