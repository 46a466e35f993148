-- Level world: objects placed in a cell and what is mounted on them.  What is placed is a row with the revisions of the
-- world in which it holds, from first_revision to last_revision, null while it holds: a revision that moves one object
-- ends one row and adds one.

CREATE SEQUENCE world_id_seq;
CREATE TABLE world (  -- world: A cell and what stands in it; a change is a new revision.
    id BIGINT PRIMARY KEY,  -- identity of this revision of the world
    name TEXT NOT NULL,  -- name of the world
    revision INTEGER NOT NULL,  -- 1 for the first, one more each time the content differs; 0 of an object alone, which no file places
    content_key TEXT NOT NULL,  -- hash of all that the world file says
    UNIQUE (name, revision)
);

CREATE VIEW current_world (  -- world: The newest revision of each world, but of objects alone: what a question is asked of unless it names a revision.
    name,  -- name of the world
    world_id,  -- identity of its newest revision
    revision,  -- its newest revision
    content_key  -- hash of all that the world file says
) AS
SELECT DISTINCT ON (name) name, id AS world_id, revision, content_key
FROM world
WHERE revision > 0
ORDER BY name, revision DESC;

CREATE TABLE world_attribute (  -- world: Attribute-value table of worlds; appended to, never changed: current_world_attribute has the newest value of each.
    world_id BIGINT NOT NULL,  -- REFERENCES world (id): the revision of a world; the next takes all values over
    name TEXT NOT NULL,  -- name of the attribute
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that stated it: the greatest has the newest value
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

CREATE VIEW current_world_attribute (  -- world: The newest value of each attribute of worlds.
    world_id, name, value_number, value_text, value_boolean, unit, source, run_id
) AS
SELECT DISTINCT ON (world_id, name) world_id, name, value_number, value_text, value_boolean, unit, source, run_id
FROM world_attribute
ORDER BY world_id, name, run_id DESC;

CREATE SEQUENCE placed_object_id_seq;
CREATE TABLE placed_object (  -- world: What was ever placed in a world under a name: it keeps its number while it moves, goes and comes back. Another object
    -- under its name, or another content, is another.
    object_no INTEGER PRIMARY KEY,  -- number of the placed object, one count for all worlds
    world TEXT NOT NULL,  -- name of the world
    name TEXT NOT NULL,  -- name of the object in the world
    object_id BIGINT NOT NULL  -- REFERENCES object (id): the object: what object_node expands
);

-- No key: DuckDB rewrites the last rows of a table with one whenever some are added.
CREATE TABLE placed_body (  -- world: Where the placed objects stand: a row for the object and one for each link of the robots in it, as the joint states
    -- place it, with the revisions of the world in which it stands there.
    object_no INTEGER NOT NULL,  -- REFERENCES placed_object (object_no): the placed object
    body_no INTEGER NOT NULL,  -- 0, or the node of object_node that is the link
    first_revision INTEGER NOT NULL,  -- first revision of the world in which this holds
    last_revision INTEGER,  -- last revision in which it holds; null: it holds in the newest
    object_variant_id BIGINT NOT NULL,  -- REFERENCES object_variant (id): what was placed: a loaded variant, in its revision
    role TEXT NOT NULL,  -- inspected (the reference), fixture, robot or tool (these occlude but are no reference)
    tolerance_mm DOUBLE PRECISION NOT NULL,  -- standard deviation of where the object's edges are from where the model has them, across an edge, mm
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_body
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,  -- least x, y and z of a box around its parts in the world, mm; null where it has none
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION,  -- greatest x, y and z of a box around its parts in the world, mm; null where it has none
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (role IN ('inspected', 'fixture', 'robot', 'tool')),
    CHECK (tolerance_mm >= 0),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK (first_revision <= last_revision)
);

CREATE VIEW world_object (  -- world: Objects placed in each revision of a world.
    world_id,  -- the world
    object_no,  -- number of the placed object
    name,  -- name of the object in the world
    object_variant_id,  -- what was placed: a loaded variant, in its revision
    object_id,  -- the object
    role,  -- inspected (the reference), fixture, robot or tool (these occlude but are no reference)
    tolerance_mm,  -- standard deviation of where the object's edges are from where the model has them, across an edge, mm
    m00, m01, m02, m03,  -- world_from_object
    m10, m11, m12, m13,
    m20, m21, m22, m23
) AS
SELECT w.id AS world_id, p.object_no, p.name, b.object_variant_id, p.object_id, b.role, b.tolerance_mm,
    b.m00, b.m01, b.m02, b.m03, b.m10, b.m11, b.m12, b.m13, b.m20, b.m21, b.m22, b.m23
FROM world AS w
JOIN placed_object AS p ON p.world = w.name
JOIN placed_body AS b ON b.object_no = p.object_no AND b.body_no = 0
    AND w.revision BETWEEN b.first_revision AND coalesce(b.last_revision, w.revision);

CREATE TABLE joint_state (  -- world: Where the joints of the robots in worlds stand, with the revisions in which they do.
    object_no INTEGER NOT NULL,  -- REFERENCES placed_object (object_no): the placed object
    robot TEXT NOT NULL,  -- path of the robot in that object; empty where it is the object itself
    joint TEXT NOT NULL,  -- name of the joint
    first_revision INTEGER NOT NULL,  -- first revision of the world in which this holds
    last_revision INTEGER,  -- last revision in which it holds; null: it holds in the newest
    value DOUBLE PRECISION NOT NULL,  -- rad of a joint that turns, mm of one that slides
    CHECK (first_revision <= last_revision),
    PRIMARY KEY (object_no, robot, joint, first_revision)
);

CREATE SEQUENCE camera_id_seq;
CREATE TABLE camera (  -- world: A calibrated camera, by content.
    id BIGINT PRIMARY KEY,  -- identity of the camera
    content_key TEXT NOT NULL UNIQUE,  -- hash of all values
    width INTEGER NOT NULL,  -- width of its pictures, px
    height INTEGER NOT NULL,  -- height of its pictures, px
    fx DOUBLE PRECISION NOT NULL, fy DOUBLE PRECISION NOT NULL,  -- focal length along x and y, px
    cx DOUBLE PRECISION NOT NULL,  -- principal point x, px; (0, 0) is the centre of the top-left pixel
    cy DOUBLE PRECISION NOT NULL,  -- principal point y, px
    skew DOUBLE PRECISION NOT NULL,  -- element (0, 1) of the camera matrix
    distortion DOUBLE PRECISION[] NOT NULL,  -- coefficients of OpenCV: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty, as many as there are
    view_u0 DOUBLE PRECISION NOT NULL, view_v0 DOUBLE PRECISION NOT NULL,  -- least x and y of all that the camera sees, freed of distortion, px: -0.5 without it
    view_u1 DOUBLE PRECISION NOT NULL,  -- greatest x of all that the camera sees, freed of distortion, px: width - 0.5 without it
    view_v1 DOUBLE PRECISION NOT NULL,  -- greatest y of all that the camera sees, freed of distortion, px: height - 0.5 without it
    CHECK (width > 0 AND height > 0 AND fx > 0 AND fy > 0),
    CHECK (view_u0 < view_u1 AND view_v0 < view_v1)
);

CREATE SEQUENCE rig_id_seq;
CREATE TABLE rig (  -- world: Rigidly connected cameras, by content.
    id BIGINT PRIMARY KEY,  -- identity of the rig
    content_key TEXT NOT NULL UNIQUE  -- hash of all its cameras and transforms
);

CREATE TABLE rig_camera (  -- world: The cameras of a rig.
    rig_id BIGINT NOT NULL,  -- REFERENCES rig (id): the rig
    name TEXT NOT NULL,  -- name of the camera in the rig
    camera_id BIGINT NOT NULL,  -- REFERENCES camera (id): its calibration
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- rig_from_camera
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    sigma_focal DOUBLE PRECISION,  -- standard deviation of the focal length, as a share of it; this and the next four are null where the rig does
        -- not say how well the camera is known
    sigma_centre_px DOUBLE PRECISION,  -- the same of the principal point along each axis, px
    sigma_translation_mm DOUBLE PRECISION,  -- the same of where the camera sits in the rig, along each axis of the camera, mm
    sigma_rotation DOUBLE PRECISION,  -- the same about each axis, rad
    sigma_radial DOUBLE PRECISION,  -- the same of the first coefficient of radial distortion
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (sigma_focal >= 0 AND sigma_centre_px >= 0 AND sigma_translation_mm >= 0 AND sigma_rotation >= 0
        AND sigma_radial >= 0),
    PRIMARY KEY (rig_id, name)
);

CREATE TABLE world_mount (  -- world: Rigs and objects fixed to an object of a world or to a link of it; the world_object of a mounted object stands where
    -- its mount and the joint states place it.
    world TEXT NOT NULL,  -- name of the world
    mount_no INTEGER NOT NULL,  -- ordinal in the world
    first_revision INTEGER NOT NULL,  -- first revision of the world in which this holds
    last_revision INTEGER,  -- last revision in which it holds; null: it holds in the newest
    name TEXT NOT NULL,  -- name of what is mounted
    object_no INTEGER NOT NULL,  -- REFERENCES placed_object (object_no): the object that carries it
    link TEXT,  -- the link of that object as the world file names it; null: its root
    object_path TEXT,  -- path of the link in that object, as in occurrence; null: its root
    rig_id BIGINT,  -- REFERENCES rig (id): the rig that is mounted, where it is one
    mounted_no INTEGER,  -- REFERENCES placed_object (object_no): the object that is mounted, where it is one
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- carrier_from_mounted
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (first_revision <= last_revision),
    PRIMARY KEY (world, mount_no, first_revision),
    CHECK ((rig_id IS NULL) <> (mounted_no IS NULL)),
    CHECK (mounted_no <> object_no)
);

-- An occurrence is a node of a placed object: its identity is 2^28 times the one's number and the other's.
CREATE VIEW placed_node (  -- world: What an occurrence is, wherever and in whichever revision of its world it stands: one row each; the identity audit rows
    -- point at.
    id,  -- identity of the occurrence
    world,  -- name of the world
    object_no,  -- the placed object that it belongs to
    node_no,  -- the node of object_node that it is
    kind,  -- object or part
    path,  -- names of the instances from the world down, joined by /
    object_id,  -- the object, where it is one
    part_id,  -- the part, where it is one
    shape_id  -- the part's geometry
) AS
SELECT CAST(p.object_no AS BIGINT) * 268435456 + n.node_no AS id, p.world, p.object_no, n.node_no,
    CASE WHEN n.part_id IS NULL THEN 'object' ELSE 'part' END AS kind, p.name || n.path AS path,
    n.child_id AS object_id, n.part_id, n.shape_id
FROM placed_object AS p
JOIN object_node AS n ON n.object_id = p.object_id;

CREATE VIEW occurrence (  -- world: Every object and part as placed in a revision of a world, with its composed transform, and of parts the world box; it
    -- keeps its identity from revision to revision.
    id,  -- identity of the occurrence, one in all revisions of its world
    world_id,  -- the world
    parent_id,  -- occurrence that contains it; null for objects placed in the world
    object_no,  -- the placed object that it belongs to
    kind,  -- object or part
    path,  -- names of the instances from the world down, joined by /
    object_id,  -- the object, where it is one
    part_id,  -- the part, where it is one
    shape_id,  -- the part's geometry
    page,  -- page of object_page that it lies in, in its object; null of objects
    m00, m01, m02, m03,  -- world_from_occurrence
    m10, m11, m12, m13,
    m20, m21, m22, m23,
    x0, y0, z0,  -- least x, y and z of the box of the transformed shape box in the world, mm, which may reach beyond the box
        -- around the part itself that parts_in_box gives; null of objects
    x1, y1, z1  -- greatest x, y and z of the box of the transformed shape box in the world, mm; null of objects
) AS
SELECT o.id, o.world_id, o.parent_id, o.object_no, o.kind, o.path, o.object_id, o.part_id, o.shape_id, o.page,
    o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23,
    least(o.m00 * s.x0, o.m00 * s.x1) + least(o.m01 * s.y0, o.m01 * s.y1) + least(o.m02 * s.z0, o.m02 * s.z1) + o.m03 AS x0,
    least(o.m10 * s.x0, o.m10 * s.x1) + least(o.m11 * s.y0, o.m11 * s.y1) + least(o.m12 * s.z0, o.m12 * s.z1) + o.m13 AS y0,
    least(o.m20 * s.x0, o.m20 * s.x1) + least(o.m21 * s.y0, o.m21 * s.y1) + least(o.m22 * s.z0, o.m22 * s.z1) + o.m23 AS z0,
    greatest(o.m00 * s.x0, o.m00 * s.x1) + greatest(o.m01 * s.y0, o.m01 * s.y1) + greatest(o.m02 * s.z0, o.m02 * s.z1) + o.m03 AS x1,
    greatest(o.m10 * s.x0, o.m10 * s.x1) + greatest(o.m11 * s.y0, o.m11 * s.y1) + greatest(o.m12 * s.z0, o.m12 * s.z1) + o.m13 AS y1,
    greatest(o.m20 * s.x0, o.m20 * s.x1) + greatest(o.m21 * s.y0, o.m21 * s.y1) + greatest(o.m22 * s.z0, o.m22 * s.z1) + o.m23 AS z1
FROM (
    SELECT CAST(p.object_no AS BIGINT) * 268435456 + n.node_no AS id, w.id AS world_id,
        CAST(p.object_no AS BIGINT) * 268435456 + n.parent_no AS parent_id, p.object_no,
        CASE WHEN n.part_id IS NULL THEN 'object' ELSE 'part' END AS kind, p.name || n.path AS path,
        n.child_id AS object_id, n.part_id, n.shape_id, n.page,
        b.m00 * n.m00 + b.m01 * n.m10 + b.m02 * n.m20 AS m00,
        b.m00 * n.m01 + b.m01 * n.m11 + b.m02 * n.m21 AS m01,
        b.m00 * n.m02 + b.m01 * n.m12 + b.m02 * n.m22 AS m02,
        b.m00 * n.m03 + b.m01 * n.m13 + b.m02 * n.m23 + b.m03 AS m03,
        b.m10 * n.m00 + b.m11 * n.m10 + b.m12 * n.m20 AS m10,
        b.m10 * n.m01 + b.m11 * n.m11 + b.m12 * n.m21 AS m11,
        b.m10 * n.m02 + b.m11 * n.m12 + b.m12 * n.m22 AS m12,
        b.m10 * n.m03 + b.m11 * n.m13 + b.m12 * n.m23 + b.m13 AS m13,
        b.m20 * n.m00 + b.m21 * n.m10 + b.m22 * n.m20 AS m20,
        b.m20 * n.m01 + b.m21 * n.m11 + b.m22 * n.m21 AS m21,
        b.m20 * n.m02 + b.m21 * n.m12 + b.m22 * n.m22 AS m22,
        b.m20 * n.m03 + b.m21 * n.m13 + b.m22 * n.m23 + b.m23 AS m23
    FROM world AS w
    JOIN placed_object AS p ON p.world = w.name
    JOIN placed_body AS b ON b.object_no = p.object_no
        AND w.revision BETWEEN b.first_revision AND coalesce(b.last_revision, w.revision)
    JOIN object_node AS n ON n.object_id = p.object_id AND n.body_no = b.body_no
) AS o
LEFT JOIN shape AS s ON s.id = o.shape_id;

CREATE VIEW placed_mount (  -- world: Where rigs and mounted objects are in their world, by the occurrence that carries them.
    world_id,  -- the world
    mount_no,  -- the mount in the world
    name,  -- name of what is mounted
    rig_id,  -- the rig, where it is one
    mounted_no,  -- object_no of what is mounted, where it is an object
    carrier,  -- path of the object or link that carries it
    m00, m01, m02, m03,  -- world_from_mounted
    m10, m11, m12, m13,
    m20, m21, m22, m23
) AS
SELECT w.id AS world_id, m.mount_no, m.name, m.rig_id, m.mounted_no, c.path AS carrier,
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
FROM world AS w
JOIN world_mount AS m ON m.world = w.name
    AND w.revision BETWEEN m.first_revision AND coalesce(m.last_revision, w.revision)
JOIN placed_object AS p ON p.object_no = m.object_no
JOIN occurrence AS c ON c.world_id = w.id AND c.object_no = m.object_no
    AND c.path = CASE WHEN m.object_path IS NULL THEN p.name ELSE p.name || '/' || m.object_path END;
