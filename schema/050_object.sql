-- Level object: assemblies, machines and robots made of parts and of other objects.

CREATE SEQUENCE object_id_seq;
CREATE TABLE object (  -- object: An assembly (or machine, robot, single part) by content: equal trees are one row.
    id BIGINT PRIMARY KEY,  -- identity of the object
    content_key TEXT NOT NULL UNIQUE,  -- hash of name, kind, attributes and of all that it is made of, with transforms
    name TEXT NOT NULL,  -- name in the source
    kind TEXT NOT NULL,  -- assembly, machine or robot
    CHECK (kind IN ('assembly', 'machine', 'robot'))
);

CREATE SEQUENCE object_variant_id_seq;
CREATE TABLE object_variant (  -- object: The name, variant and revision under which a user loaded an object.
    id BIGINT PRIMARY KEY,  -- identity of the loaded variant
    name TEXT NOT NULL,  -- name that the user gave
    variant TEXT NOT NULL,  -- variant that the user gave; empty where none
    revision INTEGER NOT NULL,  -- 1 for the first load, one more each time the content differs
    object_id BIGINT NOT NULL,  -- REFERENCES object (id): what it is
    source_id BIGINT NOT NULL,  -- REFERENCES source (id): the file it was first loaded from
    UNIQUE (name, variant, revision)
);

CREATE TABLE object_attribute (  -- object: Attribute-value table of objects; appended to, never changed: current_object_attribute has the newest value of
    -- each.
    object_id BIGINT NOT NULL,  -- REFERENCES object (id): the object
    name TEXT NOT NULL,  -- name of the attribute
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that stated it: the greatest has the newest value
    value_number DOUBLE PRECISION,  -- value, where it is a number
    value_text TEXT,  -- value, where it is text
    value_boolean BOOLEAN,  -- value, where it is true or false
    unit TEXT,  -- unit of a number; null where it has none
    source TEXT NOT NULL,  -- where the value comes from: file, derived, user
    PRIMARY KEY (object_id, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);

CREATE VIEW current_object_attribute (  -- object: The newest value of each attribute of objects.
    object_id, name, value_number, value_text, value_boolean, unit, source, run_id
) AS
SELECT DISTINCT ON (object_id, name) object_id, name, value_number, value_text, value_boolean, unit, source, run_id
FROM object_attribute
ORDER BY object_id, name, run_id DESC;

CREATE TABLE object_object (  -- object: Objects placed directly in an object.
    parent_id BIGINT NOT NULL,  -- REFERENCES object (id): the object that contains
    child_no INTEGER NOT NULL,  -- ordinal in the parent, counted over objects and parts together
    child_id BIGINT NOT NULL,  -- REFERENCES object (id): the object contained
    name TEXT NOT NULL,  -- name of the instance
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- parent_from_child
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (parent_id, child_no),
    CHECK (parent_id <> child_id)
);

CREATE TABLE object_part (  -- object: Parts placed directly in an object; those that are nested in objects placed in it are not among them: placed_part
    -- has all.
    object_id BIGINT NOT NULL,  -- REFERENCES object (id): the object that contains
    child_no INTEGER NOT NULL,  -- ordinal in the object, counted over objects and parts together
    part_id BIGINT NOT NULL,  -- REFERENCES part (id): the part contained
    name TEXT NOT NULL,  -- name of the instance
    colour TEXT,  -- colour of this instance where it differs from the part's, #rrggbb
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- object_from_part
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (object_id, child_no)
);

CREATE TABLE joint (  -- object: Joints of a robot or machine between the objects placed in it.
    object_id BIGINT NOT NULL,  -- REFERENCES object (id): the robot or machine
    joint_no INTEGER NOT NULL,  -- ordinal of the joint
    name TEXT NOT NULL,  -- name in the source
    kind TEXT NOT NULL,  -- revolute, continuous, prismatic or fixed
    parent_link TEXT NOT NULL,  -- name of the instance that carries the joint
    child_link TEXT NOT NULL,  -- name of the instance that it moves
    axis_x DOUBLE PRECISION NOT NULL, axis_y DOUBLE PRECISION NOT NULL, axis_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the joint's axis in the joint's frame, unit
    lower_limit DOUBLE PRECISION,  -- least value, rad or mm; null where unlimited
    upper_limit DOUBLE PRECISION,  -- greatest value, rad or mm; null where unlimited
    mimic_joint TEXT,  -- name of the joint that this one follows; null where it has a value of its own
    mimic_factor DOUBLE PRECISION,  -- its value is this times that of the joint it follows ...
    mimic_offset DOUBLE PRECISION,  -- ... plus this, rad or mm
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- parent_from_joint
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (object_id, joint_no),
    UNIQUE (object_id, name),
    CHECK (kind IN ('revolute', 'continuous', 'prismatic', 'fixed'))
);

CREATE TABLE load_report (  -- object: What a load found in its file and added to the store.
    run_id BIGINT PRIMARY KEY,  -- REFERENCES run (id): the run of the load
    source_id BIGINT,  -- REFERENCES source (id): the file; null where it was refused
    object_variant_id BIGINT,  -- REFERENCES object_variant (id): what it was loaded as; null where it was refused
    status TEXT NOT NULL,  -- added, unchanged (all of it was there), partial (faces were lost) or refused
    message TEXT,  -- why it is partial or was refused
    faces_in_file INTEGER,  -- faces that the text of the file lists
    faces_loaded INTEGER,  -- faces that were read from it, each part counted once
    parts INTEGER,  -- distinct parts in the file
    occurrences INTEGER,  -- placed parts in the file
    shapes_added INTEGER,  -- shapes that were new to the store
    surfaces_added INTEGER,  -- surfaces that were new to the store
    arcs_added INTEGER,  -- arcs that were new to the store
    CHECK (status IN ('added', 'unchanged', 'partial', 'refused'))
);

CREATE TABLE load_finding (  -- object: What a load noticed in its file that is not as it should be; it was loaded all the same unless load_report says that
    -- it was refused.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run of the load; load_report says which file it read
    finding_no INTEGER NOT NULL,  -- ordinal of the finding in the load, from 0
    kind TEXT NOT NULL,  -- open_loop, edge_off_face, open_solid, stated_volume, stated_area, damaged_text, unread_text, lost_faces, features_failed,
        -- ...
    message TEXT NOT NULL,  -- what was found, one sentence
    part_id BIGINT,  -- REFERENCES part (id): the part, or the first of those that have the shape; null where it is of the whole file, or was refused
    shape_id BIGINT,  -- REFERENCES shape (id): the shape; null where it is of the whole file or the part, or was refused
    surface_id BIGINT,  -- REFERENCES surface (id): the surface; null where it is of none, or was refused
    arc_id BIGINT,  -- REFERENCES arc (id): the arc; null where it is of none, or was refused
    value DOUBLE PRECISION,  -- what was measured; null where it is no measure
    bound DOUBLE PRECISION,  -- what the value was compared with; null where it is no measure
    unit TEXT,  -- unit of value and bound; null for counts and where they are null
    PRIMARY KEY (run_id, finding_no)
);

CREATE VIEW object_child (  -- object: Objects and parts placed directly in an object, with names that are unique among siblings.
    parent_id,  -- the object that contains
    child_no,  -- ordinal in the parent
    object_id,  -- the object contained; null for a part
    part_id,  -- the part contained; null for an object
    segment,  -- piece of a path: the name with / made _; with # and its ordinal where siblings share it, it is empty or holds a #
    m00, m01, m02, m03,  -- parent_from_child
    m10, m11, m12, m13,
    m20, m21, m22, m23
) AS
WITH instance AS (
    SELECT parent_id, child_no, replace(name, '/', '_') AS name, child_id AS object_id, CAST(NULL AS BIGINT) AS part_id,
        m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_object
    UNION ALL
    SELECT object_id, child_no, replace(name, '/', '_'), CAST(NULL AS BIGINT), part_id,
        m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_part
)
SELECT parent_id, child_no, object_id, part_id,
    CASE WHEN name = '' OR strpos(name, '#') > 0 OR count(*) OVER (PARTITION BY parent_id, name) > 1
        THEN name || '#' || CAST(child_no AS TEXT) ELSE name END AS segment,
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
FROM instance;

-- Of a million rows, a key, a unique path and foreign keys would take more time than all else: queries of check/ look
-- after them.
CREATE TABLE object_node (  -- object, redundant: The expansion of each object that was loaded: itself and every object and part in it, with its composed transform, and
    -- of parts the box, packed into pages of an R-tree. A world places it as it stands.
    object_id BIGINT NOT NULL,  -- the object that is expanded
    node_no INTEGER NOT NULL,  -- ordinal of the node: 0 the object itself, then the objects in it, containers first, then the parts by page
    parent_no INTEGER,  -- the node that contains it; null of the object itself
    body_no INTEGER NOT NULL,  -- the node that it moves with, in whose frame it is placed: the link of a robot that it is or is in, else 0
    path TEXT NOT NULL,  -- names of the instances from the object down, a / before each; empty of the object itself
    child_id BIGINT,  -- the object, where it is one
    part_id BIGINT,  -- the part, where it is one
    shape_id BIGINT,  -- the part's geometry
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- body_from_node
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    page INTEGER,  -- page of object_page; null of objects
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,  -- least x, y and z of the box around the part in the body's frame: around its shape's hull, widened by hull_mm, or
        -- of a shape without one around its box, mm; null of objects
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION,  -- greatest x, y and z of that box, mm; null of objects
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK ((child_id IS NULL) <> (part_id IS NULL)),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1)
);

CREATE TABLE object_page (  -- object, redundant: Pages of the parts in an expanded object: the union of their boxes; a page holds parts of one body.
    object_id BIGINT NOT NULL,  -- REFERENCES object (id): the object that is expanded
    page INTEGER NOT NULL,  -- the page, in order of the packing
    body_no INTEGER NOT NULL,  -- the body whose parts it holds
    box_count INTEGER NOT NULL,  -- number of boxes in the page
    x0 DOUBLE PRECISION NOT NULL, y0 DOUBLE PRECISION NOT NULL, z0 DOUBLE PRECISION NOT NULL,  -- least x, y and z of the page's bounding box in the body's frame, mm
    x1 DOUBLE PRECISION NOT NULL, y1 DOUBLE PRECISION NOT NULL, z1 DOUBLE PRECISION NOT NULL,  -- greatest x, y and z of the page's bounding box in the body's frame, mm
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (object_id, page)
);

CREATE TABLE circle (  -- object, redundant: Circles along which sharp edges of an object's parts run, each once, but for parts that joints move: by them it is
    -- found in space.
    object_id BIGINT NOT NULL,  -- REFERENCES object (id): the object
    circle_no INTEGER NOT NULL,  -- ordinal of the circle in the object, from 0
    x DOUBLE PRECISION NOT NULL, y DOUBLE PRECISION NOT NULL, z DOUBLE PRECISION NOT NULL,  -- x, y and z of the centre in the object's frame, mm
    nx DOUBLE PRECISION NOT NULL, ny DOUBLE PRECISION NOT NULL, nz DOUBLE PRECISION NOT NULL,  -- x, y and z of the unit normal, which may point either way
    radius DOUBLE PRECISION NOT NULL,  -- radius, mm
    PRIMARY KEY (object_id, circle_no)
);

CREATE TABLE circle_relation (  -- object, redundant: How two circles of an object lie to each other, whichever way it is turned or mirrored: a row a class of
    -- pairs that agree, with their means.
    object_id BIGINT NOT NULL,  -- REFERENCES object (id): the object
    class_no INTEGER NOT NULL,  -- ordinal of the class in the object, from 0
    pairs INTEGER NOT NULL,  -- how many pairs of circles agree
    radius_a REAL NOT NULL,  -- radius of the smaller circle, mm
    radius_b REAL NOT NULL,  -- radius of the greater, mm
    distance REAL NOT NULL,  -- distance of the centres, mm
    normals REAL NOT NULL,  -- cosine of the angle between the normals
    rise_a REAL NOT NULL,  -- cosine of the angle between the smaller circle's normal and the line of the centres
    rise_b REAL NOT NULL,  -- cosine of that of the greater
    circles INTEGER[] NOT NULL,  -- the smaller circle of each of its pairs, then, in the same order, the greater; of a class of very many pairs
    -- some, evenly among all
    PRIMARY KEY (object_id, class_no)
);
