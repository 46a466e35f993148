-- Level world: objects placed in a cell and what is mounted on them.  What is placed is a row with the revisions of the
-- world in which it holds, from first_revision to last_revision, null while it holds: a revision that moves one object
-- ends one row and adds one.

CREATE SEQUENCE world_id_seq;
CREATE TABLE world (
    id BIGINT PRIMARY KEY,
    name TEXT NOT NULL,
    revision INTEGER NOT NULL,
    content_key TEXT NOT NULL,
    UNIQUE (name, revision)
);
COMMENT ON TABLE world IS 'A cell and what stands in it; a change is a new revision.';
COMMENT ON COLUMN world.id IS 'identity of this revision of the world';
COMMENT ON COLUMN world.name IS 'name of the world';
COMMENT ON COLUMN world.revision IS '1 for the first, one more each time the content differs';
COMMENT ON COLUMN world.content_key IS 'hash of all that the world file says';

-- A table, not a view of world: to plan the view took DuckDB a third of all that a question of a small volume takes.
CREATE TABLE current_world (
    name TEXT PRIMARY KEY,
    world_id BIGINT NOT NULL,
    revision INTEGER NOT NULL,
    content_key TEXT NOT NULL
);
COMMENT ON TABLE current_world IS 'The newest revision of each world: what a question is asked of unless it names a revision.';
COMMENT ON COLUMN current_world.name IS 'name of the world';
COMMENT ON COLUMN current_world.world_id IS 'identity of its newest revision';
COMMENT ON COLUMN current_world.revision IS 'its newest revision';
COMMENT ON COLUMN current_world.content_key IS 'hash of all that the world file says';

CREATE TABLE world_attribute (
    world_id BIGINT NOT NULL,
    name TEXT NOT NULL,
    run_id BIGINT NOT NULL,
    value_number DOUBLE PRECISION,
    value_text TEXT,
    value_boolean BOOLEAN,
    unit TEXT,
    source TEXT NOT NULL,
    PRIMARY KEY (world_id, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);
COMMENT ON TABLE world_attribute IS 'Attribute-value table of worlds; appended to, never changed: current_world_attribute has the newest value of each.';
COMMENT ON COLUMN world_attribute.world_id IS 'the revision of a world; the next takes all values over';
COMMENT ON COLUMN world_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN world_attribute.run_id IS 'the run that stated it: the greatest has the newest value';
COMMENT ON COLUMN world_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN world_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN world_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN world_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN world_attribute.source IS 'where the value comes from: file, derived, user';

CREATE VIEW current_world_attribute AS
SELECT DISTINCT ON (world_id, name) world_id, name, value_number, value_text, value_boolean, unit, source, run_id
FROM world_attribute
ORDER BY world_id, name, run_id DESC;
COMMENT ON VIEW current_world_attribute IS 'The newest value of each attribute of worlds.';
COMMENT ON COLUMN current_world_attribute.world_id IS 'the revision of a world; the next takes all values over';
COMMENT ON COLUMN current_world_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN current_world_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN current_world_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN current_world_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN current_world_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN current_world_attribute.source IS 'where the value comes from: file, derived, user';
COMMENT ON COLUMN current_world_attribute.run_id IS 'the run that stated it';

CREATE SEQUENCE placed_object_id_seq;
CREATE TABLE placed_object (
    object_no INTEGER PRIMARY KEY,
    world TEXT NOT NULL,
    name TEXT NOT NULL,
    object_id BIGINT NOT NULL
);
COMMENT ON TABLE placed_object IS 'What was ever placed in a world under a name: it keeps its number while it moves, goes and comes back. Another object under its name, or another content, is another.';
COMMENT ON COLUMN placed_object.object_no IS 'number of the placed object, one count for all worlds';
COMMENT ON COLUMN placed_object.world IS 'name of the world';
COMMENT ON COLUMN placed_object.name IS 'name of the object in the world';
COMMENT ON COLUMN placed_object.object_id IS 'the object: what object_node expands';

-- No key: DuckDB writes the last rows of a table with one anew, whole, whenever some are added.
CREATE TABLE placed_body (
    object_no INTEGER NOT NULL,
    body_no INTEGER NOT NULL,
    first_revision INTEGER NOT NULL,
    last_revision INTEGER,
    object_variant_id BIGINT NOT NULL,
    role TEXT NOT NULL,
    tolerance_mm DOUBLE PRECISION NOT NULL,
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
    x0 DOUBLE PRECISION,
    y0 DOUBLE PRECISION,
    z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION,
    y1 DOUBLE PRECISION,
    z1 DOUBLE PRECISION,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (role IN ('inspected', 'fixture', 'robot', 'tool')),
    CHECK (tolerance_mm >= 0),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK (first_revision <= last_revision)
);
COMMENT ON TABLE placed_body IS 'Where the placed objects stand: a row for the object and one for each link of the robots in it, as the joint states place it, with the revisions of the world in which it stands there.';
COMMENT ON COLUMN placed_body.object_no IS 'the placed object';
COMMENT ON COLUMN placed_body.body_no IS '0, or the node of object_node that is the link';
COMMENT ON COLUMN placed_body.first_revision IS 'first revision of the world in which this holds';
COMMENT ON COLUMN placed_body.last_revision IS 'last revision in which it holds; null: it holds in the newest';
COMMENT ON COLUMN placed_body.object_variant_id IS 'what was placed: a loaded variant, in its revision';
COMMENT ON COLUMN placed_body.role IS 'inspected (the reference), fixture, robot or tool (these occlude but are no reference)';
COMMENT ON COLUMN placed_body.tolerance_mm IS 'standard deviation of where the object''s edges are from where the model has them, across an edge, mm';
COMMENT ON COLUMN placed_body.m00 IS 'world_from_body: row 0, column 0 of the rotation';
COMMENT ON COLUMN placed_body.m01 IS 'world_from_body: row 0, column 1 of the rotation';
COMMENT ON COLUMN placed_body.m02 IS 'world_from_body: row 0, column 2 of the rotation';
COMMENT ON COLUMN placed_body.m03 IS 'world_from_body: row 0 of the translation, mm';
COMMENT ON COLUMN placed_body.m10 IS 'world_from_body: row 1, column 0 of the rotation';
COMMENT ON COLUMN placed_body.m11 IS 'world_from_body: row 1, column 1 of the rotation';
COMMENT ON COLUMN placed_body.m12 IS 'world_from_body: row 1, column 2 of the rotation';
COMMENT ON COLUMN placed_body.m13 IS 'world_from_body: row 1 of the translation, mm';
COMMENT ON COLUMN placed_body.m20 IS 'world_from_body: row 2, column 0 of the rotation';
COMMENT ON COLUMN placed_body.m21 IS 'world_from_body: row 2, column 1 of the rotation';
COMMENT ON COLUMN placed_body.m22 IS 'world_from_body: row 2, column 2 of the rotation';
COMMENT ON COLUMN placed_body.m23 IS 'world_from_body: row 2 of the translation, mm';
COMMENT ON COLUMN placed_body.x0 IS 'least x of a box around its parts in the world, mm; null where it has none';
COMMENT ON COLUMN placed_body.y0 IS 'least y of a box around its parts in the world, mm; null where it has none';
COMMENT ON COLUMN placed_body.z0 IS 'least z of a box around its parts in the world, mm; null where it has none';
COMMENT ON COLUMN placed_body.x1 IS 'greatest x of a box around its parts in the world, mm; null where it has none';
COMMENT ON COLUMN placed_body.y1 IS 'greatest y of a box around its parts in the world, mm; null where it has none';
COMMENT ON COLUMN placed_body.z1 IS 'greatest z of a box around its parts in the world, mm; null where it has none';

CREATE VIEW world_object AS
SELECT w.id AS world_id, p.object_no, p.name, b.object_variant_id, p.object_id, b.role, b.tolerance_mm,
    b.m00, b.m01, b.m02, b.m03,
    b.m10, b.m11, b.m12, b.m13,
    b.m20, b.m21, b.m22, b.m23
FROM world AS w
JOIN placed_object AS p ON p.world = w.name
JOIN placed_body AS b ON b.object_no = p.object_no AND b.body_no = 0
    AND w.revision BETWEEN b.first_revision AND coalesce(b.last_revision, w.revision);
COMMENT ON VIEW world_object IS 'Objects placed in each revision of a world.';
COMMENT ON COLUMN world_object.world_id IS 'the world';
COMMENT ON COLUMN world_object.object_no IS 'number of the placed object';
COMMENT ON COLUMN world_object.name IS 'name of the object in the world';
COMMENT ON COLUMN world_object.object_variant_id IS 'what was placed: a loaded variant, in its revision';
COMMENT ON COLUMN world_object.object_id IS 'the object';
COMMENT ON COLUMN world_object.role IS 'inspected (the reference), fixture, robot or tool (these occlude but are no reference)';
COMMENT ON COLUMN world_object.tolerance_mm IS 'standard deviation of where the object''s edges are from where the model has them, across an edge, mm';
COMMENT ON COLUMN world_object.m00 IS 'world_from_object: row 0, column 0 of the rotation';
COMMENT ON COLUMN world_object.m01 IS 'world_from_object: row 0, column 1 of the rotation';
COMMENT ON COLUMN world_object.m02 IS 'world_from_object: row 0, column 2 of the rotation';
COMMENT ON COLUMN world_object.m03 IS 'world_from_object: row 0 of the translation, mm';
COMMENT ON COLUMN world_object.m10 IS 'world_from_object: row 1, column 0 of the rotation';
COMMENT ON COLUMN world_object.m11 IS 'world_from_object: row 1, column 1 of the rotation';
COMMENT ON COLUMN world_object.m12 IS 'world_from_object: row 1, column 2 of the rotation';
COMMENT ON COLUMN world_object.m13 IS 'world_from_object: row 1 of the translation, mm';
COMMENT ON COLUMN world_object.m20 IS 'world_from_object: row 2, column 0 of the rotation';
COMMENT ON COLUMN world_object.m21 IS 'world_from_object: row 2, column 1 of the rotation';
COMMENT ON COLUMN world_object.m22 IS 'world_from_object: row 2, column 2 of the rotation';
COMMENT ON COLUMN world_object.m23 IS 'world_from_object: row 2 of the translation, mm';

CREATE TABLE joint_state (
    object_no INTEGER NOT NULL,
    robot TEXT NOT NULL,
    joint TEXT NOT NULL,
    first_revision INTEGER NOT NULL,
    last_revision INTEGER,
    value DOUBLE PRECISION NOT NULL,
    CHECK (first_revision <= last_revision),
    PRIMARY KEY (object_no, robot, joint, first_revision)
);
COMMENT ON TABLE joint_state IS 'Where the joints of the robots in worlds stand, with the revisions in which they do.';
COMMENT ON COLUMN joint_state.object_no IS 'the placed object';
COMMENT ON COLUMN joint_state.robot IS 'path of the robot in that object; empty where it is the object itself';
COMMENT ON COLUMN joint_state.joint IS 'name of the joint';
COMMENT ON COLUMN joint_state.first_revision IS 'first revision of the world in which this holds';
COMMENT ON COLUMN joint_state.last_revision IS 'last revision in which it holds; null: it holds in the newest';
COMMENT ON COLUMN joint_state.value IS 'rad of a joint that turns, mm of one that slides';

CREATE SEQUENCE camera_id_seq;
CREATE TABLE camera (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE,
    width INTEGER NOT NULL,
    height INTEGER NOT NULL,
    fx DOUBLE PRECISION NOT NULL,
    fy DOUBLE PRECISION NOT NULL,
    cx DOUBLE PRECISION NOT NULL,
    cy DOUBLE PRECISION NOT NULL,
    skew DOUBLE PRECISION NOT NULL,
    distortion_model TEXT NOT NULL,
    distortion DOUBLE PRECISION[] NOT NULL,
    view_u0 DOUBLE PRECISION NOT NULL,
    view_v0 DOUBLE PRECISION NOT NULL,
    view_u1 DOUBLE PRECISION NOT NULL,
    view_v1 DOUBLE PRECISION NOT NULL,
    CHECK (width > 0 AND height > 0 AND fx > 0 AND fy > 0),
    CHECK (view_u0 < view_u1 AND view_v0 < view_v1),
    CHECK (distortion_model IN ('opencv'))
);
COMMENT ON TABLE camera IS 'A calibrated camera, by content.';
COMMENT ON COLUMN camera.id IS 'identity of the camera';
COMMENT ON COLUMN camera.content_key IS 'hash of all values';
COMMENT ON COLUMN camera.width IS 'width of its pictures, px';
COMMENT ON COLUMN camera.height IS 'height of its pictures, px';
COMMENT ON COLUMN camera.fx IS 'focal length along x, px';
COMMENT ON COLUMN camera.fy IS 'focal length along y, px';
COMMENT ON COLUMN camera.cx IS 'principal point x, px; (0, 0) is the centre of the top-left pixel';
COMMENT ON COLUMN camera.cy IS 'principal point y, px';
COMMENT ON COLUMN camera.skew IS 'element (0, 1) of the camera matrix';
COMMENT ON COLUMN camera.distortion_model IS 'opencv: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty, as many as there are';
COMMENT ON COLUMN camera.distortion IS 'coefficients of the model';
COMMENT ON COLUMN camera.view_u0 IS 'least x of all that the camera sees, freed of distortion, px: -0.5 without it';
COMMENT ON COLUMN camera.view_v0 IS 'least y of all that the camera sees, freed of distortion, px: -0.5 without it';
COMMENT ON COLUMN camera.view_u1 IS 'greatest x of all that the camera sees, freed of distortion, px: width - 0.5 without it';
COMMENT ON COLUMN camera.view_v1 IS 'greatest y of all that the camera sees, freed of distortion, px: height - 0.5 without it';

CREATE SEQUENCE rig_id_seq;
CREATE TABLE rig (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE
);
COMMENT ON TABLE rig IS 'Cameras held rigidly together, by content.';
COMMENT ON COLUMN rig.id IS 'identity of the rig';
COMMENT ON COLUMN rig.content_key IS 'hash of all its cameras and transforms';

CREATE TABLE rig_camera (
    rig_id BIGINT NOT NULL,
    name TEXT NOT NULL,
    camera_id BIGINT NOT NULL,
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
    sigma_focal DOUBLE PRECISION,
    sigma_centre_px DOUBLE PRECISION,
    sigma_translation_mm DOUBLE PRECISION,
    sigma_rotation DOUBLE PRECISION,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (sigma_focal >= 0 AND sigma_centre_px >= 0 AND sigma_translation_mm >= 0 AND sigma_rotation >= 0),
    PRIMARY KEY (rig_id, name)
);
COMMENT ON TABLE rig_camera IS 'The cameras of a rig.';
COMMENT ON COLUMN rig_camera.rig_id IS 'the rig';
COMMENT ON COLUMN rig_camera.name IS 'name of the camera in the rig: left, right';
COMMENT ON COLUMN rig_camera.camera_id IS 'its calibration';
COMMENT ON COLUMN rig_camera.m00 IS 'rig_from_camera: row 0, column 0 of the rotation';
COMMENT ON COLUMN rig_camera.m01 IS 'rig_from_camera: row 0, column 1 of the rotation';
COMMENT ON COLUMN rig_camera.m02 IS 'rig_from_camera: row 0, column 2 of the rotation';
COMMENT ON COLUMN rig_camera.m03 IS 'rig_from_camera: row 0 of the translation, mm';
COMMENT ON COLUMN rig_camera.m10 IS 'rig_from_camera: row 1, column 0 of the rotation';
COMMENT ON COLUMN rig_camera.m11 IS 'rig_from_camera: row 1, column 1 of the rotation';
COMMENT ON COLUMN rig_camera.m12 IS 'rig_from_camera: row 1, column 2 of the rotation';
COMMENT ON COLUMN rig_camera.m13 IS 'rig_from_camera: row 1 of the translation, mm';
COMMENT ON COLUMN rig_camera.m20 IS 'rig_from_camera: row 2, column 0 of the rotation';
COMMENT ON COLUMN rig_camera.m21 IS 'rig_from_camera: row 2, column 1 of the rotation';
COMMENT ON COLUMN rig_camera.m22 IS 'rig_from_camera: row 2, column 2 of the rotation';
COMMENT ON COLUMN rig_camera.m23 IS 'rig_from_camera: row 2 of the translation, mm';
COMMENT ON COLUMN rig_camera.sigma_focal IS 'standard deviation of the focal length, as a share of it; this and the next three are null where the rig does not say how well the camera is known';
COMMENT ON COLUMN rig_camera.sigma_centre_px IS 'the same of the principal point along each axis, px';
COMMENT ON COLUMN rig_camera.sigma_translation_mm IS 'the same of where the camera sits in the rig, along each axis of the camera, mm';
COMMENT ON COLUMN rig_camera.sigma_rotation IS 'the same about each axis, rad';

CREATE TABLE world_mount (
    world TEXT NOT NULL,
    mount_no INTEGER NOT NULL,
    first_revision INTEGER NOT NULL,
    last_revision INTEGER,
    name TEXT NOT NULL,
    object_no INTEGER NOT NULL,
    link TEXT,
    object_path TEXT,
    rig_id BIGINT,
    mounted_no INTEGER,
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
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (first_revision <= last_revision),
    PRIMARY KEY (world, mount_no, first_revision),
    CHECK ((rig_id IS NULL) <> (mounted_no IS NULL)),
    CHECK (mounted_no <> object_no)
);
COMMENT ON TABLE world_mount IS 'Rigs and objects fixed to an object of a world or to a link of it; the world_object of a mounted object stands where its mount and the joint states place it.';
COMMENT ON COLUMN world_mount.world IS 'name of the world';
COMMENT ON COLUMN world_mount.first_revision IS 'first revision of the world in which this holds';
COMMENT ON COLUMN world_mount.last_revision IS 'last revision in which it holds; null: it holds in the newest';
COMMENT ON COLUMN world_mount.mount_no IS 'ordinal in the world';
COMMENT ON COLUMN world_mount.name IS 'name of what is mounted';
COMMENT ON COLUMN world_mount.object_no IS 'the object that carries it';
COMMENT ON COLUMN world_mount.link IS 'the link of that object as the world file names it; null: its root';
COMMENT ON COLUMN world_mount.object_path IS 'path of the link in that object, as in occurrence; null: its root';
COMMENT ON COLUMN world_mount.rig_id IS 'the rig that is mounted, where it is one';
COMMENT ON COLUMN world_mount.mounted_no IS 'the object that is mounted, where it is one';
COMMENT ON COLUMN world_mount.m00 IS 'carrier_from_mounted: row 0, column 0 of the rotation';
COMMENT ON COLUMN world_mount.m01 IS 'carrier_from_mounted: row 0, column 1 of the rotation';
COMMENT ON COLUMN world_mount.m02 IS 'carrier_from_mounted: row 0, column 2 of the rotation';
COMMENT ON COLUMN world_mount.m03 IS 'carrier_from_mounted: row 0 of the translation, mm';
COMMENT ON COLUMN world_mount.m10 IS 'carrier_from_mounted: row 1, column 0 of the rotation';
COMMENT ON COLUMN world_mount.m11 IS 'carrier_from_mounted: row 1, column 1 of the rotation';
COMMENT ON COLUMN world_mount.m12 IS 'carrier_from_mounted: row 1, column 2 of the rotation';
COMMENT ON COLUMN world_mount.m13 IS 'carrier_from_mounted: row 1 of the translation, mm';
COMMENT ON COLUMN world_mount.m20 IS 'carrier_from_mounted: row 2, column 0 of the rotation';
COMMENT ON COLUMN world_mount.m21 IS 'carrier_from_mounted: row 2, column 1 of the rotation';
COMMENT ON COLUMN world_mount.m22 IS 'carrier_from_mounted: row 2, column 2 of the rotation';
COMMENT ON COLUMN world_mount.m23 IS 'carrier_from_mounted: row 2 of the translation, mm';

-- An occurrence is a node of a placed object: its identity is 2^28 times the one's number and the other's.
CREATE VIEW placed_node AS
SELECT CAST(p.object_no AS BIGINT) * 268435456 + n.node_no AS id, p.world, p.object_no, n.node_no,
    CASE WHEN n.part_id IS NULL THEN 'object' ELSE 'part' END AS kind, p.name || n.path AS path,
    n.child_id AS object_id, n.part_id, n.shape_id
FROM placed_object AS p
JOIN object_node AS n ON n.object_id = p.object_id;
COMMENT ON VIEW placed_node IS 'What an occurrence is, wherever and in whichever revision of its world it stands: one row each; the identity audit rows point at.';
COMMENT ON COLUMN placed_node.id IS 'identity of the occurrence';
COMMENT ON COLUMN placed_node.world IS 'name of the world';
COMMENT ON COLUMN placed_node.object_no IS 'the placed object that it belongs to';
COMMENT ON COLUMN placed_node.node_no IS 'the node of object_node that it is';
COMMENT ON COLUMN placed_node.kind IS 'object or part';
COMMENT ON COLUMN placed_node.path IS 'names of the instances from the world down, joined by /';
COMMENT ON COLUMN placed_node.object_id IS 'the object, where it is one';
COMMENT ON COLUMN placed_node.part_id IS 'the part, where it is one';
COMMENT ON COLUMN placed_node.shape_id IS 'the part''s geometry';

CREATE VIEW occurrence AS
SELECT o.id, o.world_id, o.parent_id, o.object_no, o.kind, o.path, o.object_id, o.part_id, o.shape_id, o.page,
    o.m00, o.m01, o.m02, o.m03,
    o.m10, o.m11, o.m12, o.m13,
    o.m20, o.m21, o.m22, o.m23,
    least(o.m00 * s.x0, o.m00 * s.x1) + least(o.m01 * s.y0, o.m01 * s.y1)
        + least(o.m02 * s.z0, o.m02 * s.z1) + o.m03 AS x0,
    least(o.m10 * s.x0, o.m10 * s.x1) + least(o.m11 * s.y0, o.m11 * s.y1)
        + least(o.m12 * s.z0, o.m12 * s.z1) + o.m13 AS y0,
    least(o.m20 * s.x0, o.m20 * s.x1) + least(o.m21 * s.y0, o.m21 * s.y1)
        + least(o.m22 * s.z0, o.m22 * s.z1) + o.m23 AS z0,
    greatest(o.m00 * s.x0, o.m00 * s.x1) + greatest(o.m01 * s.y0, o.m01 * s.y1)
        + greatest(o.m02 * s.z0, o.m02 * s.z1) + o.m03 AS x1,
    greatest(o.m10 * s.x0, o.m10 * s.x1) + greatest(o.m11 * s.y0, o.m11 * s.y1)
        + greatest(o.m12 * s.z0, o.m12 * s.z1) + o.m13 AS y1,
    greatest(o.m20 * s.x0, o.m20 * s.x1) + greatest(o.m21 * s.y0, o.m21 * s.y1)
        + greatest(o.m22 * s.z0, o.m22 * s.z1) + o.m23 AS z1
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
COMMENT ON VIEW occurrence IS 'Every object and part as placed in a revision of a world, with its composed transform, and of parts the world box; it keeps its identity from revision to revision.';
COMMENT ON COLUMN occurrence.id IS 'identity of the occurrence, one in all revisions of its world';
COMMENT ON COLUMN occurrence.world_id IS 'the world';
COMMENT ON COLUMN occurrence.parent_id IS 'occurrence that contains it; null for objects placed in the world';
COMMENT ON COLUMN occurrence.object_no IS 'the placed object that it belongs to';
COMMENT ON COLUMN occurrence.kind IS 'object or part';
COMMENT ON COLUMN occurrence.path IS 'names of the instances from the world down, joined by /';
COMMENT ON COLUMN occurrence.object_id IS 'the object, where it is one';
COMMENT ON COLUMN occurrence.part_id IS 'the part, where it is one';
COMMENT ON COLUMN occurrence.shape_id IS 'the part''s geometry';
COMMENT ON COLUMN occurrence.page IS 'page of object_page that it lies in, in its object; null of objects';
COMMENT ON COLUMN occurrence.m00 IS 'world_from_occurrence: row 0, column 0 of the rotation';
COMMENT ON COLUMN occurrence.m01 IS 'world_from_occurrence: row 0, column 1 of the rotation';
COMMENT ON COLUMN occurrence.m02 IS 'world_from_occurrence: row 0, column 2 of the rotation';
COMMENT ON COLUMN occurrence.m03 IS 'world_from_occurrence: row 0 of the translation, mm';
COMMENT ON COLUMN occurrence.m10 IS 'world_from_occurrence: row 1, column 0 of the rotation';
COMMENT ON COLUMN occurrence.m11 IS 'world_from_occurrence: row 1, column 1 of the rotation';
COMMENT ON COLUMN occurrence.m12 IS 'world_from_occurrence: row 1, column 2 of the rotation';
COMMENT ON COLUMN occurrence.m13 IS 'world_from_occurrence: row 1 of the translation, mm';
COMMENT ON COLUMN occurrence.m20 IS 'world_from_occurrence: row 2, column 0 of the rotation';
COMMENT ON COLUMN occurrence.m21 IS 'world_from_occurrence: row 2, column 1 of the rotation';
COMMENT ON COLUMN occurrence.m22 IS 'world_from_occurrence: row 2, column 2 of the rotation';
COMMENT ON COLUMN occurrence.m23 IS 'world_from_occurrence: row 2 of the translation, mm';
COMMENT ON COLUMN occurrence.x0 IS 'least x of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.y0 IS 'least y of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.z0 IS 'least z of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.x1 IS 'greatest x of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.y1 IS 'greatest y of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.z1 IS 'greatest z of the box of the transformed shape box in the world, mm; null of objects';

CREATE VIEW placed_mount AS
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
COMMENT ON VIEW placed_mount IS 'Where rigs and mounted objects are in their world, by the occurrence that carries them.';
COMMENT ON COLUMN placed_mount.world_id IS 'the world';
COMMENT ON COLUMN placed_mount.mount_no IS 'the mount in the world';
COMMENT ON COLUMN placed_mount.name IS 'name of what is mounted';
COMMENT ON COLUMN placed_mount.rig_id IS 'the rig, where it is one';
COMMENT ON COLUMN placed_mount.mounted_no IS 'object_no of what is mounted, where it is an object';
COMMENT ON COLUMN placed_mount.carrier IS 'path of the object or link that carries it';
COMMENT ON COLUMN placed_mount.m00 IS 'world_from_mounted: row 0, column 0 of the rotation';
COMMENT ON COLUMN placed_mount.m01 IS 'world_from_mounted: row 0, column 1 of the rotation';
COMMENT ON COLUMN placed_mount.m02 IS 'world_from_mounted: row 0, column 2 of the rotation';
COMMENT ON COLUMN placed_mount.m03 IS 'world_from_mounted: row 0 of the translation, mm';
COMMENT ON COLUMN placed_mount.m10 IS 'world_from_mounted: row 1, column 0 of the rotation';
COMMENT ON COLUMN placed_mount.m11 IS 'world_from_mounted: row 1, column 1 of the rotation';
COMMENT ON COLUMN placed_mount.m12 IS 'world_from_mounted: row 1, column 2 of the rotation';
COMMENT ON COLUMN placed_mount.m13 IS 'world_from_mounted: row 1 of the translation, mm';
COMMENT ON COLUMN placed_mount.m20 IS 'world_from_mounted: row 2, column 0 of the rotation';
COMMENT ON COLUMN placed_mount.m21 IS 'world_from_mounted: row 2, column 1 of the rotation';
COMMENT ON COLUMN placed_mount.m22 IS 'world_from_mounted: row 2, column 2 of the rotation';
COMMENT ON COLUMN placed_mount.m23 IS 'world_from_mounted: row 2 of the translation, mm';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('world', 'world', 'primary'),
    ('current_world', 'world', 'redundant'),
    ('world_attribute', 'world', 'primary'),
    ('current_world_attribute', 'world', 'view'),
    ('placed_object', 'world', 'primary'),
    ('placed_body', 'world', 'primary'),
    ('world_object', 'world', 'view'),
    ('joint_state', 'world', 'primary'),
    ('camera', 'world', 'primary'),
    ('rig', 'world', 'primary'),
    ('rig_camera', 'world', 'primary'),
    ('world_mount', 'world', 'primary'),
    ('placed_node', 'world', 'view'),
    ('occurrence', 'world', 'view'),
    ('placed_mount', 'world', 'view');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('world_attribute', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('world_attribute', 1, ARRAY['run_id'], 'run', ARRAY['id']),
    ('current_world', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('placed_object', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('placed_body', 0, ARRAY['object_no'], 'placed_object', ARRAY['object_no']),
    ('placed_body', 1, ARRAY['object_variant_id'], 'object_variant', ARRAY['id']),
    ('joint_state', 0, ARRAY['object_no'], 'placed_object', ARRAY['object_no']),
    ('rig_camera', 0, ARRAY['rig_id'], 'rig', ARRAY['id']),
    ('rig_camera', 1, ARRAY['camera_id'], 'camera', ARRAY['id']),
    ('world_mount', 0, ARRAY['rig_id'], 'rig', ARRAY['id']),
    ('world_mount', 1, ARRAY['object_no'], 'placed_object', ARRAY['object_no']),
    ('world_mount', 2, ARRAY['mounted_no'], 'placed_object', ARRAY['object_no']);
