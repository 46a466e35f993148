-- Level world: objects placed in a cell, what is mounted on them, and the expansion of it all into placed parts.

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
    id BIGINT NOT NULL,
    revision INTEGER NOT NULL,
    content_key TEXT NOT NULL
);
COMMENT ON TABLE current_world IS 'The newest revision of each world: what a question is asked of unless it names a revision.';
COMMENT ON COLUMN current_world.name IS 'name of the world';
COMMENT ON COLUMN current_world.id IS 'identity of its newest revision';
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

CREATE TABLE world_object (
    world_id BIGINT NOT NULL,
    object_no INTEGER NOT NULL,
    name TEXT NOT NULL,
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
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (world_id, object_no),
    UNIQUE (world_id, name),
    CHECK (role IN ('inspected', 'fixture', 'robot', 'tool')),
    CHECK (tolerance_mm >= 0)
);
COMMENT ON TABLE world_object IS 'Objects placed in a world.';
COMMENT ON COLUMN world_object.world_id IS 'the world';
COMMENT ON COLUMN world_object.object_no IS 'ordinal in the world';
COMMENT ON COLUMN world_object.name IS 'name of the instance';
COMMENT ON COLUMN world_object.object_variant_id IS 'the object, pinned to its variant and revision';
COMMENT ON COLUMN world_object.role IS 'inspected (the reference of localisation), or fixture, robot, tool: these occlude but are no reference';
COMMENT ON COLUMN world_object.tolerance_mm IS 'standard deviation of where the object''s edges are, across them, from where the model has them, mm';
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
    world_id BIGINT NOT NULL,
    object_no INTEGER NOT NULL,
    robot TEXT NOT NULL,
    joint TEXT NOT NULL,
    value DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (world_id, object_no, robot, joint)
);
COMMENT ON TABLE joint_state IS 'Where the joints of the robots in a world stand.';
COMMENT ON COLUMN joint_state.world_id IS 'the world';
COMMENT ON COLUMN joint_state.object_no IS 'the object that is the robot or has it nested in it';
COMMENT ON COLUMN joint_state.robot IS 'path of the robot in that object, as in occurrence; empty: the object itself';
COMMENT ON COLUMN joint_state.joint IS 'name of the joint; fixed joints are left out';
COMMENT ON COLUMN joint_state.value IS 'its value, rad or mm';

CREATE TABLE world_link (
    world_id BIGINT NOT NULL,
    object_no INTEGER NOT NULL,
    robot TEXT NOT NULL,
    child_no INTEGER NOT NULL,
    object_id BIGINT NOT NULL,
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
    PRIMARY KEY (world_id, object_no, robot, child_no)
);
COMMENT ON TABLE world_link IS 'Where the joint states place the links of the robots in a world: stands for the transforms of object_object.';
COMMENT ON COLUMN world_link.world_id IS 'the world';
COMMENT ON COLUMN world_link.object_no IS 'the object that is the robot or has it nested in it';
COMMENT ON COLUMN world_link.robot IS 'path of the robot in that object, as in occurrence; empty: the object itself';
COMMENT ON COLUMN world_link.object_id IS 'the robot as an object';
COMMENT ON COLUMN world_link.child_no IS 'ordinal of the link in the robot, as in object_object';
COMMENT ON COLUMN world_link.m00 IS 'object_from_link: row 0, column 0 of the rotation';
COMMENT ON COLUMN world_link.m01 IS 'object_from_link: row 0, column 1 of the rotation';
COMMENT ON COLUMN world_link.m02 IS 'object_from_link: row 0, column 2 of the rotation';
COMMENT ON COLUMN world_link.m03 IS 'object_from_link: row 0 of the translation, mm';
COMMENT ON COLUMN world_link.m10 IS 'object_from_link: row 1, column 0 of the rotation';
COMMENT ON COLUMN world_link.m11 IS 'object_from_link: row 1, column 1 of the rotation';
COMMENT ON COLUMN world_link.m12 IS 'object_from_link: row 1, column 2 of the rotation';
COMMENT ON COLUMN world_link.m13 IS 'object_from_link: row 1 of the translation, mm';
COMMENT ON COLUMN world_link.m20 IS 'object_from_link: row 2, column 0 of the rotation';
COMMENT ON COLUMN world_link.m21 IS 'object_from_link: row 2, column 1 of the rotation';
COMMENT ON COLUMN world_link.m22 IS 'object_from_link: row 2, column 2 of the rotation';
COMMENT ON COLUMN world_link.m23 IS 'object_from_link: row 2 of the translation, mm';

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
    world_id BIGINT NOT NULL,
    mount_no INTEGER NOT NULL,
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
    PRIMARY KEY (world_id, mount_no),
    CHECK ((rig_id IS NULL) <> (mounted_no IS NULL)),
    CHECK (mounted_no <> object_no)
);
COMMENT ON TABLE world_mount IS 'Rigs and objects fixed to an object of a world or to a link of it; the world_object of a mounted object stands where its mount and the joint states place it.';
COMMENT ON COLUMN world_mount.world_id IS 'the world';
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

-- Of a million rows, a unique path and four foreign keys would take more time than all else: check/occurrence_path and
-- check/occurrence_reference look after both.
CREATE SEQUENCE occurrence_id_seq;
CREATE TABLE occurrence (
    id BIGINT PRIMARY KEY,
    world_id BIGINT NOT NULL,
    parent_id BIGINT,
    object_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    path TEXT NOT NULL,
    object_id BIGINT,
    part_id BIGINT,
    shape_id BIGINT,
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
    page INTEGER,
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
    CHECK (kind IN ('object', 'part')),
    CHECK ((object_id IS NULL) <> (part_id IS NULL)),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1)
);
COMMENT ON TABLE occurrence IS 'Every object and part as placed in a world, with its composed transform, and of parts the world box, packed into pages of an R-tree; the identity audit rows point at.';
COMMENT ON COLUMN occurrence.id IS 'identity of the occurrence';
COMMENT ON COLUMN occurrence.world_id IS 'the world';
COMMENT ON COLUMN occurrence.parent_id IS 'occurrence that contains it; null for objects placed in the world';
COMMENT ON COLUMN occurrence.object_no IS 'the world_object that it belongs to';
COMMENT ON COLUMN occurrence.kind IS 'object or part';
COMMENT ON COLUMN occurrence.path IS 'names of the instances from the world down, joined by /';
COMMENT ON COLUMN occurrence.object_id IS 'the object, where it is one';
COMMENT ON COLUMN occurrence.part_id IS 'the part, where it is one';
COMMENT ON COLUMN occurrence.shape_id IS 'the part''s geometry';
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
COMMENT ON COLUMN occurrence.page IS 'page of box_page; null of objects';
COMMENT ON COLUMN occurrence.x0 IS 'least x of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.y0 IS 'least y of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.z0 IS 'least z of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.x1 IS 'greatest x of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.y1 IS 'greatest y of the box of the transformed shape box in the world, mm; null of objects';
COMMENT ON COLUMN occurrence.z1 IS 'greatest z of the box of the transformed shape box in the world, mm; null of objects';

CREATE VIEW occurrence_box AS
SELECT id AS occurrence_id, world_id, page, x0, y0, z0, x1, y1, z1
FROM occurrence
WHERE kind = 'part';
COMMENT ON VIEW occurrence_box IS 'World boxes of placed parts: the shape''s box carried into the world.';
COMMENT ON COLUMN occurrence_box.occurrence_id IS 'the placed part';
COMMENT ON COLUMN occurrence_box.world_id IS 'the world';
COMMENT ON COLUMN occurrence_box.page IS 'page of box_page';
COMMENT ON COLUMN occurrence_box.x0 IS 'least x of the box of the transformed shape box in the world, mm';
COMMENT ON COLUMN occurrence_box.y0 IS 'least y of the box of the transformed shape box in the world, mm';
COMMENT ON COLUMN occurrence_box.z0 IS 'least z of the box of the transformed shape box in the world, mm';
COMMENT ON COLUMN occurrence_box.x1 IS 'greatest x of the box of the transformed shape box in the world, mm';
COMMENT ON COLUMN occurrence_box.y1 IS 'greatest y of the box of the transformed shape box in the world, mm';
COMMENT ON COLUMN occurrence_box.z1 IS 'greatest z of the box of the transformed shape box in the world, mm';

CREATE VIEW mount_pose AS
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
COMMENT ON VIEW mount_pose IS 'Where rigs and mounted objects are in their world, by the occurrence that carries them.';
COMMENT ON COLUMN mount_pose.world_id IS 'the world';
COMMENT ON COLUMN mount_pose.mount_no IS 'the mount in the world';
COMMENT ON COLUMN mount_pose.name IS 'name of what is mounted';
COMMENT ON COLUMN mount_pose.rig_id IS 'the rig, where it is one';
COMMENT ON COLUMN mount_pose.mounted_no IS 'object_no of what is mounted, where it is an object';
COMMENT ON COLUMN mount_pose.carrier IS 'path of the object or link that carries it';
COMMENT ON COLUMN mount_pose.m00 IS 'world_from_mounted: row 0, column 0 of the rotation';
COMMENT ON COLUMN mount_pose.m01 IS 'world_from_mounted: row 0, column 1 of the rotation';
COMMENT ON COLUMN mount_pose.m02 IS 'world_from_mounted: row 0, column 2 of the rotation';
COMMENT ON COLUMN mount_pose.m03 IS 'world_from_mounted: row 0 of the translation, mm';
COMMENT ON COLUMN mount_pose.m10 IS 'world_from_mounted: row 1, column 0 of the rotation';
COMMENT ON COLUMN mount_pose.m11 IS 'world_from_mounted: row 1, column 1 of the rotation';
COMMENT ON COLUMN mount_pose.m12 IS 'world_from_mounted: row 1, column 2 of the rotation';
COMMENT ON COLUMN mount_pose.m13 IS 'world_from_mounted: row 1 of the translation, mm';
COMMENT ON COLUMN mount_pose.m20 IS 'world_from_mounted: row 2, column 0 of the rotation';
COMMENT ON COLUMN mount_pose.m21 IS 'world_from_mounted: row 2, column 1 of the rotation';
COMMENT ON COLUMN mount_pose.m22 IS 'world_from_mounted: row 2, column 2 of the rotation';
COMMENT ON COLUMN mount_pose.m23 IS 'world_from_mounted: row 2 of the translation, mm';

CREATE TABLE box_page (
    world_id BIGINT NOT NULL,
    page INTEGER NOT NULL,
    box_count INTEGER NOT NULL,
    overflow BOOLEAN NOT NULL,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (world_id, page)
);
COMMENT ON TABLE box_page IS 'Pages of the placed parts of a world: the union of their boxes; what a revision adds lies in overflow pages until much has changed.';
COMMENT ON COLUMN box_page.world_id IS 'the world';
COMMENT ON COLUMN box_page.page IS 'the page, in order of the packing';
COMMENT ON COLUMN box_page.box_count IS 'number of boxes in the page';
COMMENT ON COLUMN box_page.overflow IS 'whether it holds what was added after all parts of the world were last packed together';
COMMENT ON COLUMN box_page.x0 IS 'least x of the page''s bounding box in the world, mm';
COMMENT ON COLUMN box_page.y0 IS 'least y of the page''s bounding box in the world, mm';
COMMENT ON COLUMN box_page.z0 IS 'least z of the page''s bounding box in the world, mm';
COMMENT ON COLUMN box_page.x1 IS 'greatest x of the page''s bounding box in the world, mm';
COMMENT ON COLUMN box_page.y1 IS 'greatest y of the page''s bounding box in the world, mm';
COMMENT ON COLUMN box_page.z1 IS 'greatest z of the page''s bounding box in the world, mm';

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
