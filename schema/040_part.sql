-- Level part: products, and the shapes (geometry) that they have; relations of the surfaces and arcs of a shape.

CREATE SEQUENCE shape_id_seq;
CREATE TABLE shape (  -- part: A piece of geometry in its own frame, addressed by content: two parts may share one.
    id BIGINT PRIMARY KEY,  -- identity of the shape
    content_key TEXT NOT NULL UNIQUE,  -- hash of its surfaces and arcs: equal shapes are one row
    kind TEXT NOT NULL,  -- solid, sheet, mesh
    surface_count INTEGER NOT NULL,  -- number of surfaces
    arc_count INTEGER NOT NULL,  -- number of arcs
    area DOUBLE PRECISION NOT NULL,  -- sum of the surfaces' areas, mm2
    volume DOUBLE PRECISION,  -- enclosed volume, mm3; null where not closed
    x0 DOUBLE PRECISION NOT NULL, y0 DOUBLE PRECISION NOT NULL, z0 DOUBLE PRECISION NOT NULL,  -- least x, y and z of the shape's bounding box in its own frame, mm
    x1 DOUBLE PRECISION NOT NULL, y1 DOUBLE PRECISION NOT NULL, z1 DOUBLE PRECISION NOT NULL,  -- greatest x, y and z of the shape's bounding box in its own frame, mm
    hull_x DOUBLE PRECISION[], hull_y DOUBLE PRECISION[], hull_z DOUBLE PRECISION[],  -- x, y and z of the corners of the convex hull of its triangles, mm; null where it has none or fills its box
    hull_mm DOUBLE PRECISION,  -- how far at most the shape reaches beyond that hull, mm; null as they are
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK ((hull_x IS NULL) = (hull_mm IS NULL)),
    CHECK (kind IN ('solid', 'sheet', 'mesh'))
);

CREATE TABLE shape_surface (  -- part: The surfaces of a shape.
    shape_id BIGINT NOT NULL,  -- REFERENCES shape (id): the shape
    surface_no INTEGER NOT NULL,  -- ordinal of the surface in the shape, from 0
    surface_id BIGINT NOT NULL,  -- REFERENCES surface (id): the surface
    name TEXT,  -- name of the face in the source
    PRIMARY KEY (shape_id, surface_no)
);

CREATE TABLE shape_arc (  -- part: The arcs of a shape, with the surfaces they separate.
    shape_id BIGINT NOT NULL,  -- REFERENCES shape (id): the shape
    arc_no INTEGER NOT NULL,  -- ordinal of the arc in the shape, from 0
    arc_id BIGINT NOT NULL,  -- REFERENCES arc (id): the arc
    surface_a INTEGER,  -- REFERENCES shape_surface (shape_id, surface_no): surface_no of the surface whose coedge runs along the arc
    surface_b INTEGER,  -- REFERENCES shape_surface (shape_id, surface_no): surface_no of the surface whose coedge runs against it; equal to surface_a at a seam, null at a free edge
    convexity TEXT NOT NULL,  -- convex, concave, smooth (|angle| < 1 degree), seam, free, or degenerate
    angle DOUBLE PRECISION,  -- dihedral angle at mid-arc: atan2((na x nb).t, na.nb), t along the coedge of surface_a; positive convex, rad
    PRIMARY KEY (shape_id, arc_no),
    CHECK (convexity IN ('convex', 'concave', 'smooth', 'seam', 'free', 'degenerate'))
);

CREATE TABLE shape_mesh (  -- part, redundant: Triangles of a shape for casting rays and drawing; vertices are apart for each surface.
    shape_id BIGINT PRIMARY KEY,  -- REFERENCES shape (id): the shape
    chord_mm DOUBLE PRECISION NOT NULL,  -- distance of triangles from the surface that was asked for, mm
    chord_rad DOUBLE PRECISION NOT NULL,  -- angle between neighbouring normals that was asked for, rad
    deviation_mm DOUBLE PRECISION,  -- greatest measured distance between triangles and the exact geometry, mm; null where it is not known
    vertices DOUBLE PRECISION[] NOT NULL,  -- vertices, x y z after each other, mm
    normals REAL[] NOT NULL,  -- outward unit normals of the exact surface at the vertices
    triangles INTEGER[] NOT NULL,  -- vertex ordinals, three a triangle, counter-clockwise from outside
    triangle_surfaces INTEGER[] NOT NULL  -- surface_no of each triangle
);

CREATE TABLE shape_arc_sample (  -- part, redundant: Points along the arcs of a shape with the normals on both sides, for prediction of views.
    shape_id BIGINT NOT NULL,  -- the shape
    arc_no INTEGER NOT NULL,  -- REFERENCES shape_arc (shape_id, arc_no): the arc
    sample_count INTEGER NOT NULL,  -- number of points
    points DOUBLE PRECISION[] NOT NULL,  -- points, x y z after each other, mm; only the first and last where those between are evenly spaced on a
        -- straight line
    tangents REAL[] NOT NULL,  -- unit tangents towards growing t; only one where all are equal
    normals_a REAL[] NOT NULL,  -- outward unit normals of surface_a at the points; only one where all are equal
    normals_b REAL[] NOT NULL,  -- outward unit normals of surface_b; those of surface_a turned round where there is none (a free edge); only one
        -- where all are equal
    PRIMARY KEY (shape_id, arc_no),
    CHECK (sample_count > 1)
);

CREATE VIEW surface_adjacency (  -- part: Which surfaces of a shape meet along which arc.
    shape_id,  -- the shape
    arc_no,  -- the common arc
    surface_a,  -- one surface
    surface_b,  -- the other, greater than surface_a
    convexity,  -- convex, concave or smooth
    angle  -- dihedral angle, positive convex, rad
) AS
SELECT shape_id, arc_no, least(surface_a, surface_b) AS surface_a, greatest(surface_a, surface_b) AS surface_b, convexity, angle
FROM shape_arc
WHERE surface_a <> surface_b AND angle IS NOT NULL;

CREATE SEQUENCE feature_class_id_seq;
CREATE TABLE feature_class (  -- part: Congruent features: a kind with its dimensions and the form of its outline, in a frame of its own; mirror images are
    -- two.
    id BIGINT PRIMARY KEY,  -- identity of the class
    content_key TEXT NOT NULL UNIQUE,  -- hash of kind, dimensions and form
    kind TEXT NOT NULL  -- through_hole, blind_hole, pocket, slot, open_slot, step, duct, rib, flange, web, boss, lug, fillet, chamfer, groove,
        -- circular_pattern, linear_pattern, grid_pattern, body
);

CREATE TABLE feature_dimension (  -- part: Attribute-value table of feature classes: their dimensions.
    feature_class_id BIGINT NOT NULL,  -- REFERENCES feature_class (id): the class
    name TEXT NOT NULL,  -- diameter, depth, width, length, corner_radius, ...
    value DOUBLE PRECISION NOT NULL,  -- the dimension
    unit TEXT NOT NULL,  -- mm, rad, or 1 of a count
    PRIMARY KEY (feature_class_id, name)
);

CREATE TABLE feature (  -- part: A feature of a shape: a class placed by a transform.
    shape_id BIGINT NOT NULL,  -- REFERENCES shape (id): the shape
    feature_no INTEGER NOT NULL,  -- ordinal of the feature in the shape, from 0
    feature_class_id BIGINT NOT NULL,  -- REFERENCES feature_class (id): its class
    name TEXT NOT NULL,  -- name in the source, or kind and ordinal
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- shape_from_feature
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    x0 DOUBLE PRECISION NOT NULL, y0 DOUBLE PRECISION NOT NULL, z0 DOUBLE PRECISION NOT NULL,  -- least x, y and z of the feature's bounding box in the shape's frame, mm
    x1 DOUBLE PRECISION NOT NULL, y1 DOUBLE PRECISION NOT NULL, z1 DOUBLE PRECISION NOT NULL,  -- greatest x, y and z of the feature's bounding box in the shape's frame, mm
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (shape_id, feature_no)
);

CREATE TABLE feature_surface (  -- part: The surfaces that make a feature.
    shape_id BIGINT NOT NULL,  -- the shape
    feature_no INTEGER NOT NULL,  -- REFERENCES feature (shape_id, feature_no): the feature
    surface_no INTEGER NOT NULL,  -- REFERENCES shape_surface (shape_id, surface_no): the surface
    role TEXT NOT NULL,  -- wall, floor, blend, side, bore, hole, body, ...
    PRIMARY KEY (shape_id, feature_no, surface_no)
);

CREATE VIEW shape_box (  -- part: Boxes of the features, surfaces and arcs of a shape in its own frame.
    shape_id,  -- the shape
    level,  -- feature, surface or arc
    element_no,  -- feature_no, surface_no or arc_no
    name,  -- name in the source, or level and ordinal
    x0, y0, z0,  -- least x, y and z of the element's bounding box in the shape's frame, mm
    x1, y1, z1  -- greatest x, y and z of the element's bounding box in the shape's frame, mm
) AS
SELECT shape_id, 'feature' AS level, feature_no AS element_no, name, x0, y0, z0, x1, y1, z1
FROM feature
UNION ALL
SELECT u.shape_id, 'surface', u.surface_no, coalesce(u.name, 'surface ' || CAST(u.surface_no AS TEXT)), s.x0, s.y0, s.z0, s.x1, s.y1, s.z1
FROM shape_surface AS u
JOIN surface AS s ON s.id = u.surface_id
UNION ALL
SELECT u.shape_id, 'arc', u.arc_no, 'arc ' || CAST(u.arc_no AS TEXT), a.x0, a.y0, a.z0, a.x1, a.y1, a.z1
FROM shape_arc AS u
JOIN arc AS a ON a.id = u.arc_id;

CREATE SEQUENCE part_id_seq;
CREATE TABLE part (  -- part: A product: number, name, and the shape it has; material, colour and the like are its attributes.
    id BIGINT PRIMARY KEY,  -- identity of the part
    content_key TEXT NOT NULL UNIQUE,  -- hash of number, name, attributes and shape: equal parts are one row
    number TEXT NOT NULL,  -- part number in the source
    name TEXT NOT NULL,  -- name in the source
    shape_id BIGINT NOT NULL  -- REFERENCES shape (id): its geometry
);

CREATE TABLE part_attribute (  -- part: Attribute-value table of parts; appended to, never changed: current_part_attribute has the newest value of each.
    part_id BIGINT NOT NULL,  -- REFERENCES part (id): the part
    name TEXT NOT NULL,  -- name of the attribute
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that stated it: the greatest has the newest value
    value_number DOUBLE PRECISION,  -- value, where it is a number
    value_text TEXT,  -- value, where it is text
    value_boolean BOOLEAN,  -- value, where it is true or false
    unit TEXT,  -- unit of a number; null where it has none
    source TEXT NOT NULL,  -- where the value comes from: file, derived, user
    PRIMARY KEY (part_id, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);

CREATE VIEW current_part_attribute (  -- part: The newest value of each attribute of parts.
    part_id, name, value_number, value_text, value_boolean, unit, source, run_id
) AS
SELECT DISTINCT ON (part_id, name) part_id, name, value_number, value_text, value_boolean, unit, source, run_id
FROM part_attribute
ORDER BY part_id, name, run_id DESC;

CREATE TABLE surface_attribute (  -- surface: Attribute-value table of the surfaces of a shape; appended to, never changed: current_surface_attribute has the
    -- newest value of each.
    shape_id BIGINT NOT NULL,  -- the shape: what parts share it share the value
    surface_no INTEGER NOT NULL,  -- REFERENCES shape_surface (shape_id, surface_no): the surface in it
    name TEXT NOT NULL,  -- name of the attribute
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that stated it: the greatest has the newest value
    value_number DOUBLE PRECISION,  -- value, where it is a number
    value_text TEXT,  -- value, where it is text
    value_boolean BOOLEAN,  -- value, where it is true or false
    unit TEXT,  -- unit of a number; null where it has none
    source TEXT NOT NULL,  -- where the value comes from: file, derived, user
    PRIMARY KEY (shape_id, surface_no, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);

CREATE VIEW current_surface_attribute (  -- surface: The newest value of each attribute of the surfaces of a shape.
    shape_id, surface_no, name, value_number, value_text, value_boolean, unit, source, run_id
) AS
SELECT DISTINCT ON (shape_id, surface_no, name) shape_id, surface_no, name, value_number, value_text, value_boolean, unit, source, run_id
FROM surface_attribute
ORDER BY shape_id, surface_no, name, run_id DESC;

CREATE TABLE arc_attribute (  -- surface: Attribute-value table of the arcs of a shape; appended to, never changed: current_arc_attribute has the newest value
    -- of each.
    shape_id BIGINT NOT NULL,  -- the shape: what parts share it share the value
    arc_no INTEGER NOT NULL,  -- REFERENCES shape_arc (shape_id, arc_no): the arc in it
    name TEXT NOT NULL,  -- name of the attribute
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that stated it: the greatest has the newest value
    value_number DOUBLE PRECISION,  -- value, where it is a number
    value_text TEXT,  -- value, where it is text
    value_boolean BOOLEAN,  -- value, where it is true or false
    unit TEXT,  -- unit of a number; null where it has none
    source TEXT NOT NULL,  -- where the value comes from: file, derived, user
    PRIMARY KEY (shape_id, arc_no, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);

CREATE VIEW current_arc_attribute (  -- surface: The newest value of each attribute of the arcs of a shape.
    shape_id, arc_no, name, value_number, value_text, value_boolean, unit, source, run_id
) AS
SELECT DISTINCT ON (shape_id, arc_no, name) shape_id, arc_no, name, value_number, value_text, value_boolean, unit, source, run_id
FROM arc_attribute
ORDER BY shape_id, arc_no, name, run_id DESC;

CREATE VIEW part_mass (  -- part: Mass of one piece of each part that encloses a volume and whose density is known; placed_part has all that
    -- an object holds.
    part_id,  -- the part
    number,  -- its number
    volume,  -- volume of its shape, mm3
    density,  -- its density, kg/m3
    mass,  -- volume times density, kg
    source,  -- where the density comes from: file, derived, user
    run_id  -- the run that stated the density
) AS
SELECT p.id AS part_id, p.number, s.volume, a.value_number * u.factor AS density,
    s.volume * 1e-9 * a.value_number * u.factor AS mass, a.source, a.run_id
FROM part AS p
JOIN shape AS s ON s.id = p.shape_id
JOIN current_part_attribute AS a ON a.part_id = p.id AND a.name = 'density'
JOIN unit_of_measure AS u ON u.symbol = a.unit AND u.dimension = 'density'
WHERE s.volume IS NOT NULL;

CREATE TABLE part_pmi (  -- part: Product and manufacturing information of a part: dimensions, geometric tolerances, datums.
    part_id BIGINT NOT NULL,  -- REFERENCES part (id): the part
    pmi_no INTEGER NOT NULL,  -- ordinal: dimensions, tolerances, datums, each in the order of the file
    kind TEXT NOT NULL,  -- dimension, tolerance or datum
    type TEXT NOT NULL,  -- of a dimension diameter, radius, linear distance, angle ...; of a tolerance position, flatness, surface profile ...; of a
        -- datum feature, target, or datum where the file shows neither
    name TEXT NOT NULL,  -- name in the file, or empty
    value DOUBLE PRECISION,  -- nominal value of a dimension, width of a tolerance zone; null where the file gives none
    lower_limit DOUBLE PRECISION,  -- least value that a dimension may have; null where it is not bounded
    upper_limit DOUBLE PRECISION,  -- greatest value that a dimension may have; null where it is not bounded
    unit TEXT,  -- unit of value and limits: mm or rad
    stated_unit TEXT,  -- unit in the file
    modifier TEXT,  -- maximum or least material requirement, class of a fit, note, or shape and number of a datum target
    zone TEXT,  -- form of a tolerance zone, where the file gives one
    PRIMARY KEY (part_id, pmi_no),
    CHECK (kind IN ('dimension', 'tolerance', 'datum'))
);

CREATE TABLE part_pmi_datum (  -- part: Datums that a tolerance refers to; of a datum its own letter.
    part_id BIGINT NOT NULL,  -- the part
    pmi_no INTEGER NOT NULL,  -- REFERENCES part_pmi (part_id, pmi_no): the tolerance or datum
    precedence INTEGER NOT NULL,  -- 1 primary, 2 secondary, 3 tertiary
    letter TEXT NOT NULL,  -- letter, or letters joined by - where several act as one
    modifier TEXT,  -- such as maximum material requirement; null where there is none
    PRIMARY KEY (part_id, pmi_no, precedence)
);

CREATE TABLE part_pmi_surface (  -- part: Surfaces that a dimension, tolerance or datum is of.
    part_id BIGINT NOT NULL,  -- the part
    pmi_no INTEGER NOT NULL,  -- REFERENCES part_pmi (part_id, pmi_no): the dimension, tolerance or datum
    shape_id BIGINT NOT NULL,  -- the part's shape
    surface_no INTEGER NOT NULL,  -- REFERENCES shape_surface (shape_id, surface_no): the surface in it
    role TEXT NOT NULL,  -- feature; of a distance or angle between two, origin or target
    PRIMARY KEY (part_id, pmi_no, surface_no),
    CHECK (role IN ('feature', 'origin', 'target'))
);

CREATE VIEW surface_pmi (  -- surface: Dimensions, tolerances and datums by the surface that they are of.
    part_id,  -- the part
    shape_id,  -- the part's shape
    surface_no,  -- the surface in it
    role,  -- feature; of a distance or angle between two, origin or target
    pmi_no,  -- the dimension, tolerance or datum, as in part_pmi
    kind,  -- dimension, tolerance or datum
    type,  -- as in part_pmi: diameter, flatness, ...
    name,  -- name in the file, or empty
    value,  -- nominal value of a dimension, width of a tolerance zone
    lower_limit,  -- least value that a dimension may have
    upper_limit,  -- greatest value that a dimension may have
    unit,  -- unit of value and limits: mm or rad
    modifier,  -- as in part_pmi
    zone,  -- form of a tolerance zone
    datums  -- letters of the datums that a tolerance refers to, the first of them first; of a datum its own
) AS
SELECT f.part_id, f.shape_id, f.surface_no, f.role, m.pmi_no, m.kind, m.type, m.name, m.value, m.lower_limit, m.upper_limit,
    m.unit, m.modifier, m.zone, d.datums
FROM part_pmi_surface AS f
JOIN part_pmi AS m ON m.part_id = f.part_id AND m.pmi_no = f.pmi_no
LEFT JOIN (
    SELECT part_id, pmi_no, string_agg(letter, ', ' ORDER BY precedence) AS datums
    FROM part_pmi_datum
    GROUP BY part_id, pmi_no
) AS d ON d.part_id = f.part_id AND d.pmi_no = f.pmi_no;
