-- Level world: objects placed in a cell, what is mounted on them, and the expansion of it all into placed parts.

CREATE SEQUENCE world_id_seq;
CREATE TABLE world (  -- A cell and what stands in it; a change is a new revision.
    id BIGINT PRIMARY KEY,  -- identity of this revision of the world
    name TEXT NOT NULL,  -- name of the world
    revision INTEGER NOT NULL,  -- 1 for the first, one more each time the content differs
    content_key TEXT NOT NULL,  -- hash of all that the world file says
    UNIQUE (name, revision)
);

-- A table, not a view of world: to plan the view took DuckDB a third of all that a question of a small volume takes.
CREATE TABLE current_world (  -- The newest revision of each world: what a question is asked of unless it names a revision.
    name TEXT PRIMARY KEY,  -- name of the world
    id BIGINT NOT NULL,  -- identity of its newest revision
    revision INTEGER NOT NULL,  -- its newest revision
    content_key TEXT NOT NULL  -- hash of all that the world file says
);

CREATE TABLE world_attribute (  -- Attribute-value table of worlds; appended to, never changed: current_world_attribute has the newest value of each.
    world_id BIGINT NOT NULL,  -- the revision of a world; the next takes all values over
    name TEXT NOT NULL,  -- name of the attribute
    run_id BIGINT NOT NULL,  -- the run that stated it: the greatest has the newest value
    value_number DOUBLE PRECISION,  -- value, where it is a number
    value_text TEXT,  -- value, where it is text
    value_boolean BOOLEAN,  -- value, where it is true or false
    unit TEXT,  -- unit of a number; null where it has none
    source TEXT NOT NULL,  -- where the value comes from: file, derived, user
    PRIMARY KEY (world_id, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);

CREATE VIEW current_world_attribute (  -- The newest value of each attribute of worlds.
    world_id,  -- the revision of a world; the next takes all values over
    name,  -- name of the attribute
    value_number,  -- value, where it is a number
    value_text,  -- value, where it is text
    value_boolean,  -- value, where it is true or false
    unit,  -- unit of a number; null where it has none
    source,  -- where the value comes from: file, derived, user
    run_id  -- the run that stated it
) AS
SELECT DISTINCT ON (world_id, name) world_id, name, value_number, value_text, value_boolean, unit, source, run_id
FROM world_attribute
ORDER BY world_id, name, run_id DESC;

CREATE TABLE world_object (  -- Objects placed in a world.
    world_id BIGINT NOT NULL,  -- the world
    object_no INTEGER NOT NULL,  -- ordinal in the world
    name TEXT NOT NULL,  -- name of the instance
    object_variant_id BIGINT NOT NULL,  -- the object, pinned to its variant and revision
    role TEXT NOT NULL,  -- inspected (the reference of localisation), or fixture, robot, tool: these occlude but are no reference
    tolerance_mm DOUBLE PRECISION NOT NULL,  -- standard deviation of where the object's edges are, across them, from where the model has them, mm
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_object
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (world_id, object_no),
    UNIQUE (world_id, name),
    CHECK (role IN ('inspected', 'fixture', 'robot', 'tool')),
    CHECK (tolerance_mm >= 0)
);

CREATE TABLE joint_state (  -- Where the joints of the robots in a world stand.
    world_id BIGINT NOT NULL,  -- the world
    object_no INTEGER NOT NULL,  -- the object that is the robot or has it nested in it
    robot TEXT NOT NULL,  -- path of the robot in that object, as in occurrence; empty: the object itself
    joint TEXT NOT NULL,  -- name of the joint; fixed joints are left out
    value DOUBLE PRECISION NOT NULL,  -- its value, rad or mm
    PRIMARY KEY (world_id, object_no, robot, joint)
);

CREATE TABLE world_link (  -- Where the joint states place the links of the robots in a world: stands for the transforms of object_object.
    world_id BIGINT NOT NULL,  -- the world
    object_no INTEGER NOT NULL,  -- the object that is the robot or has it nested in it
    robot TEXT NOT NULL,  -- path of the robot in that object, as in occurrence; empty: the object itself
    child_no INTEGER NOT NULL,  -- ordinal of the link in the robot, as in object_object
    object_id BIGINT NOT NULL,  -- the robot as an object
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- object_from_link
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (world_id, object_no, robot, child_no)
);

CREATE SEQUENCE camera_id_seq;
CREATE TABLE camera (  -- A calibrated camera, by content.
    id BIGINT PRIMARY KEY,  -- identity of the camera
    content_key TEXT NOT NULL UNIQUE,  -- hash of all values
    width INTEGER NOT NULL,  -- width of its pictures, px
    height INTEGER NOT NULL,  -- height of its pictures, px
    fx DOUBLE PRECISION NOT NULL,  -- focal length along x, px
    fy DOUBLE PRECISION NOT NULL,  -- focal length along y, px
    cx DOUBLE PRECISION NOT NULL,  -- principal point x, px; (0, 0) is the centre of the top-left pixel
    cy DOUBLE PRECISION NOT NULL,  -- principal point y, px
    skew DOUBLE PRECISION NOT NULL,  -- element (0, 1) of the camera matrix
    distortion_model TEXT NOT NULL,  -- opencv: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty, as many as there are
    distortion DOUBLE PRECISION[] NOT NULL,  -- coefficients of the model
    view_u0 DOUBLE PRECISION NOT NULL,  -- least x of all that the camera sees, freed of distortion, px: -0.5 without it
    view_v0 DOUBLE PRECISION NOT NULL,  -- least y of all that the camera sees, freed of distortion, px: -0.5 without it
    view_u1 DOUBLE PRECISION NOT NULL,  -- greatest x of all that the camera sees, freed of distortion, px: width - 0.5 without it
    view_v1 DOUBLE PRECISION NOT NULL,  -- greatest y of all that the camera sees, freed of distortion, px: height - 0.5 without it
    CHECK (width > 0 AND height > 0 AND fx > 0 AND fy > 0),
    CHECK (view_u0 < view_u1 AND view_v0 < view_v1),
    CHECK (distortion_model IN ('opencv'))
);

CREATE SEQUENCE rig_id_seq;
CREATE TABLE rig (  -- Cameras held rigidly together, by content.
    id BIGINT PRIMARY KEY,  -- identity of the rig
    content_key TEXT NOT NULL UNIQUE  -- hash of all its cameras and transforms
);

CREATE TABLE rig_camera (  -- The cameras of a rig.
    rig_id BIGINT NOT NULL,  -- the rig
    name TEXT NOT NULL,  -- name of the camera in the rig: left, right
    camera_id BIGINT NOT NULL,  -- its calibration
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- rig_from_camera
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    sigma_focal DOUBLE PRECISION,  -- standard deviation of the focal length, as a share of it; this and the next three are null where the rig does
        -- not say how well the camera is known
    sigma_centre_px DOUBLE PRECISION,  -- the same of the principal point along each axis, px
    sigma_translation_mm DOUBLE PRECISION,  -- the same of where the camera sits in the rig, along each axis of the camera, mm
    sigma_rotation DOUBLE PRECISION,  -- the same about each axis, rad
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (sigma_focal >= 0 AND sigma_centre_px >= 0 AND sigma_translation_mm >= 0 AND sigma_rotation >= 0),
    PRIMARY KEY (rig_id, name)
);

CREATE TABLE world_mount (  -- Rigs and objects fixed to an object of a world or to a link of it; the world_object of a mounted object stands where
    -- its mount and the joint states place it.
    world_id BIGINT NOT NULL,  -- the world
    mount_no INTEGER NOT NULL,  -- ordinal in the world
    name TEXT NOT NULL,  -- name of what is mounted
    object_no INTEGER NOT NULL,  -- the object that carries it
    link TEXT,  -- the link of that object as the world file names it; null: its root
    object_path TEXT,  -- path of the link in that object, as in occurrence; null: its root
    rig_id BIGINT,  -- the rig that is mounted, where it is one
    mounted_no INTEGER,  -- the object that is mounted, where it is one
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- carrier_from_mounted
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (world_id, mount_no),
    CHECK ((rig_id IS NULL) <> (mounted_no IS NULL)),
    CHECK (mounted_no <> object_no)
);

-- Of a million rows, a unique path and four foreign keys would take more time than all else: check/occurrence_path and
-- check/occurrence_reference look after both.
CREATE SEQUENCE occurrence_id_seq;
CREATE TABLE occurrence (  -- Every object and part as placed in a world, with its composed transform, and of parts the world box, packed into pages
    -- of an R-tree; the identity audit rows point at.
    id BIGINT PRIMARY KEY,  -- identity of the occurrence
    world_id BIGINT NOT NULL,  -- the world
    parent_id BIGINT,  -- occurrence that contains it; null for objects placed in the world
    object_no INTEGER NOT NULL,  -- the world_object that it belongs to
    kind TEXT NOT NULL,  -- object or part
    path TEXT NOT NULL,  -- names of the instances from the world down, joined by /
    object_id BIGINT,  -- the object, where it is one
    part_id BIGINT,  -- the part, where it is one
    shape_id BIGINT,  -- the part's geometry
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_occurrence
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    page INTEGER,  -- page of box_page; null of objects
    x0 DOUBLE PRECISION,  -- least x of the box of the transformed shape box in the world, mm; null of objects
    y0 DOUBLE PRECISION,  -- least y of the box of the transformed shape box in the world, mm; null of objects
    z0 DOUBLE PRECISION,  -- least z of the box of the transformed shape box in the world, mm; null of objects
    x1 DOUBLE PRECISION,  -- greatest x of the box of the transformed shape box in the world, mm; null of objects
    y1 DOUBLE PRECISION,  -- greatest y of the box of the transformed shape box in the world, mm; null of objects
    z1 DOUBLE PRECISION,  -- greatest z of the box of the transformed shape box in the world, mm; null of objects
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (kind IN ('object', 'part')),
    CHECK ((object_id IS NULL) <> (part_id IS NULL)),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1)
);

CREATE VIEW occurrence_box (  -- World boxes of placed parts: the shape's box carried into the world.
    occurrence_id,  -- the placed part
    world_id,  -- the world
    page,  -- page of box_page
    x0,  -- least x of the box of the transformed shape box in the world, mm
    y0,  -- least y of the box of the transformed shape box in the world, mm
    z0,  -- least z of the box of the transformed shape box in the world, mm
    x1,  -- greatest x of the box of the transformed shape box in the world, mm
    y1,  -- greatest y of the box of the transformed shape box in the world, mm
    z1  -- greatest z of the box of the transformed shape box in the world, mm
) AS
SELECT id AS occurrence_id, world_id, page, x0, y0, z0, x1, y1, z1
FROM occurrence
WHERE kind = 'part';

CREATE VIEW mount_pose (  -- Where rigs and mounted objects are in their world, by the occurrence that carries them.
    world_id,  -- the world
    mount_no,  -- the mount in the world
    name,  -- name of what is mounted
    rig_id,  -- the rig, where it is one
    mounted_no,  -- object_no of what is mounted, where it is an object
    carrier,  -- path of the object or link that carries it
    m00,  -- world_from_mounted: row 0, column 0 of the rotation
    m01,  -- world_from_mounted: row 0, column 1 of the rotation
    m02,  -- world_from_mounted: row 0, column 2 of the rotation
    m03,  -- world_from_mounted: row 0 of the translation, mm
    m10,  -- world_from_mounted: row 1, column 0 of the rotation
    m11,  -- world_from_mounted: row 1, column 1 of the rotation
    m12,  -- world_from_mounted: row 1, column 2 of the rotation
    m13,  -- world_from_mounted: row 1 of the translation, mm
    m20,  -- world_from_mounted: row 2, column 0 of the rotation
    m21,  -- world_from_mounted: row 2, column 1 of the rotation
    m22,  -- world_from_mounted: row 2, column 2 of the rotation
    m23  -- world_from_mounted: row 2 of the translation, mm
) AS
SELECT m.world_id, m.mount_no, m.name, m.rig_id, m.mounted_no, c.path AS carrier,
    c.m00 * m.m00 + c.m01 * m.m10 + c.m02 * m.m20 AS m00,
    c.m00 * m.m01 + c.m01 * m.m11 + c.m02 * m.m21 AS m01,
    c.m00 * m.m02 + c.m01 * m.m12 + c.m02 * m.m22 AS m02,
    c.m00 * m.m03 + c.m01 * m.m13 + c.m02 * m.m23 + c.m03 AS m03,
    c.m10 * m.m00 + c.m11 * m.m10 + c.m12 * m.m20 AS m10,
    c.m10 * m.m01 + c.m11 * m.m11 + c.m12 * m.m21 AS m11,
    c.m10 * m.m02 + c.m11 * m.m12 + c.m12 * m.m22 AS m12,
    c.m10 * m.m03 + c.m11 * m.m13 + c.m12 * m.m23 + c.m13 AS m13,
    c.m20 * m.m00 + c.m21 * m.m10 + c.m22 * m.m20 AS m20,
    c.m20 * m.m01 + c.m21 * m.m11 + c.m22 * m.m21 AS m21,
    c.m20 * m.m02 + c.m21 * m.m12 + c.m22 * m.m22 AS m22,
    c.m20 * m.m03 + c.m21 * m.m13 + c.m22 * m.m23 + c.m23 AS m23
FROM world_mount AS m
JOIN world_object AS w ON w.world_id = m.world_id AND w.object_no = m.object_no
JOIN occurrence AS c ON c.world_id = m.world_id
    AND c.path = CASE WHEN m.object_path IS NULL THEN w.name ELSE w.name || '/' || m.object_path END;

CREATE TABLE box_page (  -- Pages of the placed parts of a world: the union of their boxes; what a revision adds lies in overflow pages until much has
    -- changed.
    world_id BIGINT NOT NULL,  -- the world
    page INTEGER NOT NULL,  -- the page, in order of the packing
    box_count INTEGER NOT NULL,  -- number of boxes in the page
    overflow BOOLEAN NOT NULL,  -- whether it holds what was added after all parts of the world were last packed together
    x0 DOUBLE PRECISION NOT NULL,  -- least x of the page's bounding box in the world, mm
    y0 DOUBLE PRECISION NOT NULL,  -- least y of the page's bounding box in the world, mm
    z0 DOUBLE PRECISION NOT NULL,  -- least z of the page's bounding box in the world, mm
    x1 DOUBLE PRECISION NOT NULL,  -- greatest x of the page's bounding box in the world, mm
    y1 DOUBLE PRECISION NOT NULL,  -- greatest y of the page's bounding box in the world, mm
    z1 DOUBLE PRECISION NOT NULL,  -- greatest z of the page's bounding box in the world, mm
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (world_id, page)
);

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('world', 'world', 'primary'),
    ('current_world', 'world', 'redundant'),
    ('world_attribute', 'world', 'primary'),
    ('current_world_attribute', 'world', 'view'),
    ('world_object', 'world', 'primary'),
    ('joint_state', 'world', 'primary'),
    ('world_link', 'world', 'redundant'),
    ('camera', 'world', 'primary'),
    ('rig', 'world', 'primary'),
    ('rig_camera', 'world', 'primary'),
    ('world_mount', 'world', 'primary'),
    ('occurrence', 'world', 'redundant'),
    ('occurrence_box', 'world', 'view'),
    ('mount_pose', 'world', 'view'),
    ('box_page', 'world', 'redundant');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('world_attribute', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('world_attribute', 1, ARRAY['run_id'], 'run', ARRAY['id']),
    ('world_object', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('world_object', 1, ARRAY['object_variant_id'], 'object_variant', ARRAY['id']),
    ('joint_state', 0, ARRAY['world_id', 'object_no'], 'world_object', ARRAY['world_id', 'object_no']),
    ('world_link', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('world_link', 1, ARRAY['world_id', 'object_no'], 'world_object', ARRAY['world_id', 'object_no']),
    ('rig_camera', 0, ARRAY['rig_id'], 'rig', ARRAY['id']),
    ('rig_camera', 1, ARRAY['camera_id'], 'camera', ARRAY['id']),
    ('world_mount', 0, ARRAY['rig_id'], 'rig', ARRAY['id']),
    ('world_mount', 1, ARRAY['world_id', 'object_no'], 'world_object', ARRAY['world_id', 'object_no']),
    ('world_mount', 2, ARRAY['world_id', 'mounted_no'], 'world_object', ARRAY['world_id', 'object_no']),
    ('box_page', 0, ARRAY['world_id'], 'world', ARRAY['id']);
