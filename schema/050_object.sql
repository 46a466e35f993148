-- Level object: assemblies, machines and robots made of parts and of other objects.

CREATE SEQUENCE object_id_seq;
CREATE TABLE object (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    kind TEXT NOT NULL,
    CHECK (kind IN ('assembly', 'machine', 'robot'))
);
COMMENT ON TABLE object IS 'An assembly (or machine, robot, single part) by content: equal trees are one row.';
COMMENT ON COLUMN object.id IS 'identity of the object';
COMMENT ON COLUMN object.content_key IS 'hash of name, kind, attributes and of all that it is made of, with transforms';
COMMENT ON COLUMN object.name IS 'name in the source';
COMMENT ON COLUMN object.kind IS 'assembly, machine or robot';

CREATE SEQUENCE object_variant_id_seq;
CREATE TABLE object_variant (
    id BIGINT PRIMARY KEY,
    name TEXT NOT NULL,
    variant TEXT NOT NULL,
    revision INTEGER NOT NULL,
    object_id BIGINT NOT NULL,
    source_id BIGINT NOT NULL,
    UNIQUE (name, variant, revision)
);
COMMENT ON TABLE object_variant IS 'The name, variant and revision under which a user loaded an object.';
COMMENT ON COLUMN object_variant.id IS 'identity of the loaded variant';
COMMENT ON COLUMN object_variant.name IS 'name that the user gave';
COMMENT ON COLUMN object_variant.variant IS 'variant that the user gave; empty where none';
COMMENT ON COLUMN object_variant.revision IS '1 for the first load, one more each time the content differs';
COMMENT ON COLUMN object_variant.object_id IS 'what it is';
COMMENT ON COLUMN object_variant.source_id IS 'the file it was first loaded from';

CREATE TABLE object_attribute (
    object_id BIGINT NOT NULL,
    name TEXT NOT NULL,
    run_id BIGINT NOT NULL,
    value_number DOUBLE PRECISION,
    value_text TEXT,
    value_boolean BOOLEAN,
    unit TEXT,
    source TEXT NOT NULL,
    PRIMARY KEY (object_id, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);
COMMENT ON TABLE object_attribute IS 'Attribute-value table of objects; appended to, never changed: current_object_attribute has the newest value of each.';
COMMENT ON COLUMN object_attribute.object_id IS 'the object';
COMMENT ON COLUMN object_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN object_attribute.run_id IS 'the run that stated it: the greatest has the newest value';
COMMENT ON COLUMN object_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN object_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN object_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN object_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN object_attribute.source IS 'where the value comes from: file, derived, user';

CREATE VIEW current_object_attribute AS
SELECT DISTINCT ON (object_id, name) object_id, name, value_number, value_text, value_boolean, unit, source, run_id
FROM object_attribute
ORDER BY object_id, name, run_id DESC;
COMMENT ON VIEW current_object_attribute IS 'The newest value of each attribute of objects.';
COMMENT ON COLUMN current_object_attribute.object_id IS 'the object';
COMMENT ON COLUMN current_object_attribute.name IS 'name of the attribute';
COMMENT ON COLUMN current_object_attribute.value_number IS 'value, where it is a number';
COMMENT ON COLUMN current_object_attribute.value_text IS 'value, where it is text';
COMMENT ON COLUMN current_object_attribute.value_boolean IS 'value, where it is true or false';
COMMENT ON COLUMN current_object_attribute.unit IS 'unit of a number; null where it has none';
COMMENT ON COLUMN current_object_attribute.source IS 'where the value comes from: file, derived, user';
COMMENT ON COLUMN current_object_attribute.run_id IS 'the run that stated it';

CREATE TABLE object_object (
    parent_id BIGINT NOT NULL,
    child_no INTEGER NOT NULL,
    child_id BIGINT NOT NULL,
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
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (parent_id, child_no),
    CHECK (parent_id <> child_id)
);
COMMENT ON TABLE object_object IS 'Objects placed directly in an object.';
COMMENT ON COLUMN object_object.parent_id IS 'the object that contains';
COMMENT ON COLUMN object_object.child_no IS 'ordinal in the parent, counted over objects and parts together';
COMMENT ON COLUMN object_object.child_id IS 'the object contained';
COMMENT ON COLUMN object_object.name IS 'name of the instance';
COMMENT ON COLUMN object_object.m00 IS 'parent_from_child: row 0, column 0 of the rotation';
COMMENT ON COLUMN object_object.m01 IS 'parent_from_child: row 0, column 1 of the rotation';
COMMENT ON COLUMN object_object.m02 IS 'parent_from_child: row 0, column 2 of the rotation';
COMMENT ON COLUMN object_object.m03 IS 'parent_from_child: row 0 of the translation, mm';
COMMENT ON COLUMN object_object.m10 IS 'parent_from_child: row 1, column 0 of the rotation';
COMMENT ON COLUMN object_object.m11 IS 'parent_from_child: row 1, column 1 of the rotation';
COMMENT ON COLUMN object_object.m12 IS 'parent_from_child: row 1, column 2 of the rotation';
COMMENT ON COLUMN object_object.m13 IS 'parent_from_child: row 1 of the translation, mm';
COMMENT ON COLUMN object_object.m20 IS 'parent_from_child: row 2, column 0 of the rotation';
COMMENT ON COLUMN object_object.m21 IS 'parent_from_child: row 2, column 1 of the rotation';
COMMENT ON COLUMN object_object.m22 IS 'parent_from_child: row 2, column 2 of the rotation';
COMMENT ON COLUMN object_object.m23 IS 'parent_from_child: row 2 of the translation, mm';

CREATE TABLE object_part (
    object_id BIGINT NOT NULL,
    child_no INTEGER NOT NULL,
    part_id BIGINT NOT NULL,
    name TEXT NOT NULL,
    colour TEXT,
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
    PRIMARY KEY (object_id, child_no)
);
COMMENT ON TABLE object_part IS 'Parts placed directly in an object; those that are nested in objects placed in it are not among them: placed_part counts all.';
COMMENT ON COLUMN object_part.object_id IS 'the object that contains';
COMMENT ON COLUMN object_part.child_no IS 'ordinal in the object, counted over objects and parts together';
COMMENT ON COLUMN object_part.part_id IS 'the part contained';
COMMENT ON COLUMN object_part.name IS 'name of the instance';
COMMENT ON COLUMN object_part.colour IS 'colour of this instance where it differs from the part''s, #rrggbb';
COMMENT ON COLUMN object_part.m00 IS 'object_from_part: row 0, column 0 of the rotation';
COMMENT ON COLUMN object_part.m01 IS 'object_from_part: row 0, column 1 of the rotation';
COMMENT ON COLUMN object_part.m02 IS 'object_from_part: row 0, column 2 of the rotation';
COMMENT ON COLUMN object_part.m03 IS 'object_from_part: row 0 of the translation, mm';
COMMENT ON COLUMN object_part.m10 IS 'object_from_part: row 1, column 0 of the rotation';
COMMENT ON COLUMN object_part.m11 IS 'object_from_part: row 1, column 1 of the rotation';
COMMENT ON COLUMN object_part.m12 IS 'object_from_part: row 1, column 2 of the rotation';
COMMENT ON COLUMN object_part.m13 IS 'object_from_part: row 1 of the translation, mm';
COMMENT ON COLUMN object_part.m20 IS 'object_from_part: row 2, column 0 of the rotation';
COMMENT ON COLUMN object_part.m21 IS 'object_from_part: row 2, column 1 of the rotation';
COMMENT ON COLUMN object_part.m22 IS 'object_from_part: row 2, column 2 of the rotation';
COMMENT ON COLUMN object_part.m23 IS 'object_from_part: row 2 of the translation, mm';

CREATE TABLE part_contact (
    object_id BIGINT NOT NULL,
    object_path_a TEXT NOT NULL,
    surface_a INTEGER NOT NULL,
    object_path_b TEXT NOT NULL,
    surface_b INTEGER NOT NULL,
    kind TEXT NOT NULL,
    gap DOUBLE PRECISION NOT NULL,
    area DOUBLE PRECISION NOT NULL,
    tolerance DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (object_id, object_path_a, surface_a, object_path_b, surface_b),
    CHECK (kind IN ('planar', 'cylindrical', 'conical', 'spherical', 'toroidal')),
    CHECK (abs(gap) <= tolerance)
);
COMMENT ON TABLE part_contact IS 'Faces of parts, placed in an object by different instances, that touch; what touches within one instance is a row of the object that stands there.';
COMMENT ON COLUMN part_contact.object_id IS 'the object';
COMMENT ON COLUMN part_contact.object_path_a IS 'path of one placed part within the object';
COMMENT ON COLUMN part_contact.surface_a IS 'surface_no of its face in the shape of the part';
COMMENT ON COLUMN part_contact.object_path_b IS 'path of the other, later in the order of the file';
COMMENT ON COLUMN part_contact.surface_b IS 'surface_no of its face';
COMMENT ON COLUMN part_contact.kind IS 'planar: flat faces that lie on each other; cylindrical: a shaft in a hole, on one axis; conical: a taper in its seat; spherical: a ball in its socket; toroidal: a ring in its groove';
COMMENT ON COLUMN part_contact.gap IS 'distance of flat faces and of cones, else radius of the hole (of a groove, of its section) less that of the shaft; negative where they overlap, mm';
COMMENT ON COLUMN part_contact.area IS 'area over which the faces lie opposite each other, on the shaft where the radii differ, mm2';
COMMENT ON COLUMN part_contact.tolerance IS 'greatest gap, and greatest overlap, that counts as contact, mm';

CREATE TABLE joint (
    object_id BIGINT NOT NULL,
    joint_no INTEGER NOT NULL,
    name TEXT NOT NULL,
    kind TEXT NOT NULL,
    parent_link TEXT NOT NULL,
    child_link TEXT NOT NULL,
    axis_x DOUBLE PRECISION NOT NULL,
    axis_y DOUBLE PRECISION NOT NULL,
    axis_z DOUBLE PRECISION NOT NULL,
    lower_limit DOUBLE PRECISION,
    upper_limit DOUBLE PRECISION,
    mimic_joint TEXT,
    mimic_factor DOUBLE PRECISION,
    mimic_offset DOUBLE PRECISION,
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
    PRIMARY KEY (object_id, joint_no),
    UNIQUE (object_id, name),
    CHECK (kind IN ('revolute', 'continuous', 'prismatic', 'fixed'))
);
COMMENT ON TABLE joint IS 'Joints of a robot or machine between the objects placed in it.';
COMMENT ON COLUMN joint.object_id IS 'the robot or machine';
COMMENT ON COLUMN joint.joint_no IS 'ordinal of the joint';
COMMENT ON COLUMN joint.name IS 'name in the source';
COMMENT ON COLUMN joint.kind IS 'revolute, continuous, prismatic or fixed';
COMMENT ON COLUMN joint.parent_link IS 'name of the instance that carries the joint';
COMMENT ON COLUMN joint.child_link IS 'name of the instance that it moves';
COMMENT ON COLUMN joint.axis_x IS 'x of the joint''s axis in the joint''s frame, unit';
COMMENT ON COLUMN joint.axis_y IS 'y of the joint''s axis in the joint''s frame, unit';
COMMENT ON COLUMN joint.axis_z IS 'z of the joint''s axis in the joint''s frame, unit';
COMMENT ON COLUMN joint.lower_limit IS 'least value, rad or mm; null where unlimited';
COMMENT ON COLUMN joint.upper_limit IS 'greatest value, rad or mm; null where unlimited';
COMMENT ON COLUMN joint.mimic_joint IS 'name of the joint that this one follows; null where it has a value of its own';
COMMENT ON COLUMN joint.mimic_factor IS 'its value is this times that of the joint it follows ...';
COMMENT ON COLUMN joint.mimic_offset IS '... plus this, rad or mm';
COMMENT ON COLUMN joint.m00 IS 'parent_from_joint: row 0, column 0 of the rotation';
COMMENT ON COLUMN joint.m01 IS 'parent_from_joint: row 0, column 1 of the rotation';
COMMENT ON COLUMN joint.m02 IS 'parent_from_joint: row 0, column 2 of the rotation';
COMMENT ON COLUMN joint.m03 IS 'parent_from_joint: row 0 of the translation, mm';
COMMENT ON COLUMN joint.m10 IS 'parent_from_joint: row 1, column 0 of the rotation';
COMMENT ON COLUMN joint.m11 IS 'parent_from_joint: row 1, column 1 of the rotation';
COMMENT ON COLUMN joint.m12 IS 'parent_from_joint: row 1, column 2 of the rotation';
COMMENT ON COLUMN joint.m13 IS 'parent_from_joint: row 1 of the translation, mm';
COMMENT ON COLUMN joint.m20 IS 'parent_from_joint: row 2, column 0 of the rotation';
COMMENT ON COLUMN joint.m21 IS 'parent_from_joint: row 2, column 1 of the rotation';
COMMENT ON COLUMN joint.m22 IS 'parent_from_joint: row 2, column 2 of the rotation';
COMMENT ON COLUMN joint.m23 IS 'parent_from_joint: row 2 of the translation, mm';

CREATE TABLE load_report (
    run_id BIGINT PRIMARY KEY,
    source_id BIGINT,
    object_variant_id BIGINT,
    status TEXT NOT NULL,
    message TEXT,
    faces_in_file INTEGER,
    faces_loaded INTEGER,
    parts INTEGER,
    occurrences INTEGER,
    supplemental_parts INTEGER,
    shapes_added INTEGER,
    surfaces_added INTEGER,
    arcs_added INTEGER,
    CHECK (status IN ('added', 'unchanged', 'partial', 'refused'))
);
COMMENT ON TABLE load_report IS 'What a load found in its file and added to the store.';
COMMENT ON COLUMN load_report.run_id IS 'the run of the load';
COMMENT ON COLUMN load_report.source_id IS 'the file; null where it was refused';
COMMENT ON COLUMN load_report.object_variant_id IS 'what it was loaded as; null where it was refused';
COMMENT ON COLUMN load_report.status IS 'added, unchanged (all of it was there), partial (faces were lost) or refused';
COMMENT ON COLUMN load_report.message IS 'why it is partial or was refused';
COMMENT ON COLUMN load_report.faces_in_file IS 'faces that the text of the file lists';
COMMENT ON COLUMN load_report.faces_loaded IS 'faces that were read from it, each part counted once';
COMMENT ON COLUMN load_report.parts IS 'distinct parts in the file, supplemental ones left out';
COMMENT ON COLUMN load_report.occurrences IS 'placed parts in the file, supplemental ones left out';
COMMENT ON COLUMN load_report.supplemental_parts IS 'distinct supplemental parts in the file';
COMMENT ON COLUMN load_report.shapes_added IS 'shapes that were new to the store';
COMMENT ON COLUMN load_report.surfaces_added IS 'surfaces that were new to the store';
COMMENT ON COLUMN load_report.arcs_added IS 'arcs that were new to the store';

CREATE TABLE load_finding (
    run_id BIGINT NOT NULL,
    finding_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    message TEXT NOT NULL,
    part_id BIGINT,
    shape_id BIGINT,
    surface_id BIGINT,
    arc_id BIGINT,
    value DOUBLE PRECISION,
    bound DOUBLE PRECISION,
    unit TEXT,
    PRIMARY KEY (run_id, finding_no)
);
COMMENT ON TABLE load_finding IS 'What a load noticed in its file that is not as it should be; it was loaded all the same unless load_report says that it was refused.';
COMMENT ON COLUMN load_finding.run_id IS 'the run of the load; load_report says which file it read';
COMMENT ON COLUMN load_finding.finding_no IS 'ordinal of the finding in the load, from 0';
COMMENT ON COLUMN load_finding.kind IS 'open_loop, edge_off_face, open_solid, stated_volume, stated_area, damaged_text, unread_text, lost_faces, features_failed, ...';
COMMENT ON COLUMN load_finding.message IS 'what was found, one sentence';
COMMENT ON COLUMN load_finding.part_id IS 'the part, or the first of those that have the shape; null where it is of the whole file, or was refused';
COMMENT ON COLUMN load_finding.shape_id IS 'the shape; null where it is of the whole file or the part, or was refused';
COMMENT ON COLUMN load_finding.surface_id IS 'the surface; null where it is of none, or was refused';
COMMENT ON COLUMN load_finding.arc_id IS 'the arc; null where it is of none, or was refused';
COMMENT ON COLUMN load_finding.value IS 'what was measured; null where it is no measure';
COMMENT ON COLUMN load_finding.bound IS 'what the value was held against; null where it is no measure';
COMMENT ON COLUMN load_finding.unit IS 'unit of value and bound; null for counts and where they are null';

CREATE VIEW object_child AS
WITH instance AS (
    SELECT parent_id, child_no, replace(name, '/', '_') AS name, child_id AS object_id, CAST(NULL AS BIGINT) AS part_id,
        m00, m01, m02, m03,
        m10, m11, m12, m13,
        m20, m21, m22, m23
    FROM object_object
    UNION ALL
    SELECT object_id, child_no, replace(name, '/', '_'), CAST(NULL AS BIGINT), part_id,
        m00, m01, m02, m03,
        m10, m11, m12, m13,
        m20, m21, m22, m23
    FROM object_part
)
SELECT parent_id, child_no, object_id, part_id,
    CASE WHEN name = '' OR strpos(name, '#') > 0 OR count(*) OVER (PARTITION BY parent_id, name) > 1
        THEN name || '#' || CAST(child_no AS TEXT) ELSE name END AS segment,
    m00, m01, m02, m03,
    m10, m11, m12, m13,
    m20, m21, m22, m23
FROM instance;
COMMENT ON VIEW object_child IS 'Objects and parts placed directly in an object, with names that are unique among siblings.';
COMMENT ON COLUMN object_child.parent_id IS 'the object that contains';
COMMENT ON COLUMN object_child.child_no IS 'ordinal in the parent';
COMMENT ON COLUMN object_child.object_id IS 'the object contained; null for a part';
COMMENT ON COLUMN object_child.part_id IS 'the part contained; null for an object';
COMMENT ON COLUMN object_child.segment IS 'piece of a path: the name with / made _; with # and its ordinal where siblings share it, it is empty or holds a #';
COMMENT ON COLUMN object_child.m00 IS 'parent_from_child: row 0, column 0 of the rotation';
COMMENT ON COLUMN object_child.m01 IS 'parent_from_child: row 0, column 1 of the rotation';
COMMENT ON COLUMN object_child.m02 IS 'parent_from_child: row 0, column 2 of the rotation';
COMMENT ON COLUMN object_child.m03 IS 'parent_from_child: row 0 of the translation, mm';
COMMENT ON COLUMN object_child.m10 IS 'parent_from_child: row 1, column 0 of the rotation';
COMMENT ON COLUMN object_child.m11 IS 'parent_from_child: row 1, column 1 of the rotation';
COMMENT ON COLUMN object_child.m12 IS 'parent_from_child: row 1, column 2 of the rotation';
COMMENT ON COLUMN object_child.m13 IS 'parent_from_child: row 1 of the translation, mm';
COMMENT ON COLUMN object_child.m20 IS 'parent_from_child: row 2, column 0 of the rotation';
COMMENT ON COLUMN object_child.m21 IS 'parent_from_child: row 2, column 1 of the rotation';
COMMENT ON COLUMN object_child.m22 IS 'parent_from_child: row 2, column 2 of the rotation';
COMMENT ON COLUMN object_child.m23 IS 'parent_from_child: row 2 of the translation, mm';

CREATE VIEW placed_part AS
WITH RECURSIVE inside AS (  -- each object with itself and all that is placed below it, as often as it is
    SELECT id AS object_id, id AS parent_id
    FROM object
    UNION ALL
    SELECT i.object_id, c.child_id
    FROM inside AS i
    JOIN object_object AS c ON c.parent_id = i.parent_id
),
counted AS (
    SELECT i.object_id, p.part_id, count(*) AS placed
    FROM inside AS i
    JOIN object_part AS p ON p.object_id = i.parent_id
    GROUP BY i.object_id, p.part_id
)
SELECT c.object_id, c.part_id, p.number, p.name, c.placed, a.value_text AS material, m.density, c.placed * m.mass AS mass
FROM counted AS c
JOIN part AS p ON p.id = c.part_id AND NOT p.supplemental
LEFT JOIN current_part_attribute AS a ON a.part_id = p.id AND a.name = 'material'
LEFT JOIN part_mass AS m ON m.part_id = p.id;
COMMENT ON VIEW placed_part IS 'The parts of an object, those nested in objects placed in it among them: a row a part, with how often it is placed and what all of these weigh. The masses of an object''s rows add up to its mass, but for parts whose mass is null.';
COMMENT ON COLUMN placed_part.object_id IS 'the object, as in object_variant, or one that is placed in others';
COMMENT ON COLUMN placed_part.part_id IS 'the part; supplemental ones are left out';
COMMENT ON COLUMN placed_part.number IS 'its number';
COMMENT ON COLUMN placed_part.name IS 'its name';
COMMENT ON COLUMN placed_part.placed IS 'how often it is placed in the object, at any depth';
COMMENT ON COLUMN placed_part.material IS 'its material; null where that is not known';
COMMENT ON COLUMN placed_part.density IS 'its density, kg/m3; null where that is not known or it encloses no volume';
COMMENT ON COLUMN placed_part.mass IS 'mass of all of them, kg; null likewise: part_mass has that of one';

-- Of a million rows, a key, a unique path and foreign keys would take more time than all else: queries of check/ look
-- after them.
CREATE TABLE object_node (
    object_id BIGINT NOT NULL,
    node_no INTEGER NOT NULL,
    parent_no INTEGER,
    body_no INTEGER NOT NULL,
    path TEXT NOT NULL,
    child_id BIGINT,
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
    CHECK ((child_id IS NULL) <> (part_id IS NULL)),
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1)
);
COMMENT ON TABLE object_node IS 'The expansion of each object that was loaded: itself and every object and part in it, with its composed transform, and of parts the box, packed into pages of an R-tree; supplemental parts are left out. A world places it as it stands.';
COMMENT ON COLUMN object_node.object_id IS 'the object that is expanded';
COMMENT ON COLUMN object_node.node_no IS 'ordinal of the node: 0 the object itself, then the objects in it, containers first, then the parts by page';
COMMENT ON COLUMN object_node.parent_no IS 'the node that contains it; null of the object itself';
COMMENT ON COLUMN object_node.body_no IS 'the node that it moves with, in whose frame it is placed: the link of a robot that it is or is in, else 0';
COMMENT ON COLUMN object_node.path IS 'names of the instances from the object down, a / before each; empty of the object itself';
COMMENT ON COLUMN object_node.child_id IS 'the object, where it is one';
COMMENT ON COLUMN object_node.part_id IS 'the part, where it is one';
COMMENT ON COLUMN object_node.shape_id IS 'the part''s geometry';
COMMENT ON COLUMN object_node.m00 IS 'body_from_node: row 0, column 0 of the rotation';
COMMENT ON COLUMN object_node.m01 IS 'body_from_node: row 0, column 1 of the rotation';
COMMENT ON COLUMN object_node.m02 IS 'body_from_node: row 0, column 2 of the rotation';
COMMENT ON COLUMN object_node.m03 IS 'body_from_node: row 0 of the translation, mm';
COMMENT ON COLUMN object_node.m10 IS 'body_from_node: row 1, column 0 of the rotation';
COMMENT ON COLUMN object_node.m11 IS 'body_from_node: row 1, column 1 of the rotation';
COMMENT ON COLUMN object_node.m12 IS 'body_from_node: row 1, column 2 of the rotation';
COMMENT ON COLUMN object_node.m13 IS 'body_from_node: row 1 of the translation, mm';
COMMENT ON COLUMN object_node.m20 IS 'body_from_node: row 2, column 0 of the rotation';
COMMENT ON COLUMN object_node.m21 IS 'body_from_node: row 2, column 1 of the rotation';
COMMENT ON COLUMN object_node.m22 IS 'body_from_node: row 2, column 2 of the rotation';
COMMENT ON COLUMN object_node.m23 IS 'body_from_node: row 2 of the translation, mm';
COMMENT ON COLUMN object_node.page IS 'page of object_page; null of objects';
COMMENT ON COLUMN object_node.x0 IS 'least x of the box of the transformed shape box in the body''s frame, mm; null of objects';
COMMENT ON COLUMN object_node.y0 IS 'least y of the box of the transformed shape box in the body''s frame, mm; null of objects';
COMMENT ON COLUMN object_node.z0 IS 'least z of the box of the transformed shape box in the body''s frame, mm; null of objects';
COMMENT ON COLUMN object_node.x1 IS 'greatest x of the box of the transformed shape box in the body''s frame, mm; null of objects';
COMMENT ON COLUMN object_node.y1 IS 'greatest y of the box of the transformed shape box in the body''s frame, mm; null of objects';
COMMENT ON COLUMN object_node.z1 IS 'greatest z of the box of the transformed shape box in the body''s frame, mm; null of objects';

CREATE TABLE object_page (
    object_id BIGINT NOT NULL,
    page INTEGER NOT NULL,
    body_no INTEGER NOT NULL,
    box_count INTEGER NOT NULL,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (object_id, page)
);
COMMENT ON TABLE object_page IS 'Pages of the parts in an expanded object: the union of their boxes; a page holds parts of one body.';
COMMENT ON COLUMN object_page.object_id IS 'the object that is expanded';
COMMENT ON COLUMN object_page.page IS 'the page, in order of the packing';
COMMENT ON COLUMN object_page.body_no IS 'the body whose parts it holds';
COMMENT ON COLUMN object_page.box_count IS 'number of boxes in the page';
COMMENT ON COLUMN object_page.x0 IS 'least x of the page''s bounding box in the body''s frame, mm';
COMMENT ON COLUMN object_page.y0 IS 'least y of the page''s bounding box in the body''s frame, mm';
COMMENT ON COLUMN object_page.z0 IS 'least z of the page''s bounding box in the body''s frame, mm';
COMMENT ON COLUMN object_page.x1 IS 'greatest x of the page''s bounding box in the body''s frame, mm';
COMMENT ON COLUMN object_page.y1 IS 'greatest y of the page''s bounding box in the body''s frame, mm';
COMMENT ON COLUMN object_page.z1 IS 'greatest z of the page''s bounding box in the body''s frame, mm';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('object', 'object', 'primary'),
    ('object_variant', 'object', 'primary'),
    ('object_attribute', 'object', 'primary'),
    ('current_object_attribute', 'object', 'view'),
    ('object_object', 'object', 'primary'),
    ('object_part', 'object', 'primary'),
    ('object_child', 'object', 'view'),
    ('placed_part', 'object', 'view'),

    ('object_node', 'object', 'redundant'),
    ('object_page', 'object', 'redundant'),
    ('part_contact', 'object', 'redundant'),
    ('joint', 'object', 'primary'),
    ('load_report', 'object', 'primary'),
    ('load_finding', 'object', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('object_variant', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('object_variant', 1, ARRAY['source_id'], 'source', ARRAY['id']),
    ('object_attribute', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('object_attribute', 1, ARRAY['run_id'], 'run', ARRAY['id']),
    ('object_object', 0, ARRAY['parent_id'], 'object', ARRAY['id']),
    ('object_object', 1, ARRAY['child_id'], 'object', ARRAY['id']),
    ('object_part', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('object_part', 1, ARRAY['part_id'], 'part', ARRAY['id']),
    ('object_page', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('part_contact', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('joint', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('load_report', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('load_report', 1, ARRAY['source_id'], 'source', ARRAY['id']),
    ('load_report', 2, ARRAY['object_variant_id'], 'object_variant', ARRAY['id']),
    ('load_finding', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('load_finding', 1, ARRAY['part_id'], 'part', ARRAY['id']),
    ('load_finding', 2, ARRAY['shape_id'], 'shape', ARRAY['id']),
    ('load_finding', 3, ARRAY['surface_id'], 'surface', ARRAY['id']),
    ('load_finding', 4, ARRAY['arc_id'], 'arc', ARRAY['id']);
