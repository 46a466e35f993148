-- Flat views: what people ask most, ready to filter and to add up.  Keys have one name in all of them: object, variant and
-- revision of a loaded variant; object_path within an object, path within a world; run_id; camera.  Before this file are
-- run_summary, pose_world, matched_arc, rejected_arc and camera_residual, which go with them (docs/views.md).

CREATE VIEW placed_part (  -- object: The parts of each loaded variant in its newest revision, those nested in objects placed in it among them: a row a
    -- placed part. Masses add up, but for parts whose mass is null.
    object,  -- name of the object, as loaded
    variant,  -- its variant
    revision,  -- its newest revision
    object_path,  -- names of the instances from the object down, joined by /
    number,  -- number of the part
    name,  -- its name
    material,  -- its material; null where that is not known
    density,  -- its density, kg/m3; null where that is not known or it encloses no volume
    mass,  -- its mass, kg; null likewise
    part_id,  -- the part
    shape_id  -- its geometry
) AS
SELECT v.name AS object, v.variant, v.revision, substr(n.path, 2) AS object_path, p.number, p.name, a.value_text AS material,
    m.density, m.mass, p.id AS part_id, n.shape_id
FROM object_variant AS v
JOIN object_node AS n ON n.object_id = v.object_id
JOIN part AS p ON p.id = n.part_id
LEFT JOIN current_part_attribute AS a ON a.part_id = p.id AND a.name = 'material'
LEFT JOIN part_mass AS m ON m.part_id = p.id
WHERE NOT EXISTS (
    SELECT 1
    FROM object_variant AS later
    WHERE later.name = v.name AND later.variant = v.variant AND later.revision > v.revision
);

CREATE VIEW placed_part_feature (  -- object: The features of placed parts with their dimensions: a row a dimension, one of nulls for a feature without any.
    object,  -- name of the object, as loaded
    variant,  -- its variant
    revision,  -- its newest revision
    object_path,  -- path of the placed part in the object
    number,  -- number of the part
    feature_no,  -- the feature in the part's shape
    kind,  -- through_hole, pocket, rib, ... as in feature_class
    feature,  -- name of the feature
    dimension,  -- diameter, depth, thickness, ... as in feature_dimension
    value,  -- the dimension
    unit,  -- mm, rad, or 1 of a count
    x, y, z,  -- x, y and z of the middle of its box in the frame of the part's shape, mm
    shape_id  -- the part's geometry
) AS
SELECT p.object, p.variant, p.revision, p.object_path, p.number, f.feature_no, k.kind, f.name AS feature,
    d.name AS dimension, d.value, d.unit, (f.x0 + f.x1) / 2 AS x, (f.y0 + f.y1) / 2 AS y, (f.z0 + f.z1) / 2 AS z, p.shape_id
FROM placed_part AS p
JOIN feature AS f ON f.shape_id = p.shape_id
JOIN feature_class AS k ON k.id = f.feature_class_id
LEFT JOIN feature_dimension AS d ON d.feature_class_id = k.id;

CREATE VIEW world_part (  -- world: The parts that stand in the newest revision of each world, at whatever depth.
    world,  -- name of the world
    world_revision,  -- its newest revision
    path,  -- names of the instances from the world down, joined by /
    object,  -- name of the object that it is in, as loaded
    variant,  -- its variant
    revision,  -- its revision
    role,  -- inspected, fixture, robot or tool
    number,  -- number of the part
    name,  -- its name
    mass,  -- its mass, kg; null where its density is not known or it encloses no volume
    x0, y0, z0,  -- least x, y and z of its box in the world, mm
    x1, y1, z1,  -- greatest x, y and z of its box in the world, mm
    occurrence_id,  -- the placed part
    shape_id  -- its geometry
) AS
SELECT w.name AS world, w.revision AS world_revision, o.path, v.name AS object, v.variant, v.revision, s.role, p.number,
    p.name, m.mass, o.x0, o.y0, o.z0, o.x1, o.y1, o.z1, o.id AS occurrence_id, o.shape_id
FROM current_world AS w
JOIN occurrence AS o ON o.world_id = w.world_id
JOIN world_object AS s ON s.world_id = o.world_id AND s.object_no = o.object_no
JOIN object_variant AS v ON v.id = s.object_variant_id
JOIN part AS p ON p.id = o.part_id
LEFT JOIN part_mass AS m ON m.part_id = p.id;

CREATE VIEW loaded_file (  -- run: The files that were loaded or refused, each with what it became.
    run_id,  -- the run of the load
    began_at,  -- when it began
    file,  -- name of the file; null where it was refused
    object,  -- name of the object that it was loaded as; null where it was refused
    variant,  -- its variant
    revision,  -- its revision
    status,  -- added, unchanged, partial or refused
    message,  -- why it is partial or was refused
    parts,  -- distinct parts in the file
    surfaces_added,  -- surfaces that were new to the store
    findings  -- how many things were not as they should be: load_finding has them
) AS
SELECT l.run_id, r.began_at, s.file_name AS file, v.name AS object, v.variant, v.revision, l.status, l.message, l.parts,
    l.surfaces_added, (SELECT count(*) FROM load_finding AS f WHERE f.run_id = l.run_id) AS findings
FROM load_report AS l
JOIN run AS r ON r.id = l.run_id
LEFT JOIN object_variant AS v ON v.id = l.object_variant_id
LEFT JOIN source AS s ON s.id = l.source_id;

CREATE VIEW inspected_object (  -- localisation: Inspections with the objects that they looked at: a row for each, with how many of its parts and features in
    -- view are in which state, all null where nothing of it was looked at, as where the pose is refused.
    run_id,  -- the run
    began_at,  -- when it began
    world,  -- name of the world
    world_revision,  -- its revision
    path,  -- name of the object in the world
    object,  -- its name, as loaded
    variant,  -- the variant that the world has there
    revision,  -- its revision
    verdict,  -- accepted, ambiguous or refused: of the pose
    confirmed,  -- parts and features that are as the model says
    changed,  -- that are there in another size or place
    contradicted,  -- in whose place something else is
    not_confirmed,  -- that should be seen and are not
    undecidable  -- of which the pictures do not tell
) AS
SELECT i.run_id, r.began_at, w.name AS world, w.revision AS world_revision, o.name AS path, v.name AS object, v.variant,
    v.revision, i.verdict, c.confirmed, c.changed, c.contradicted, c.not_confirmed, c.undecidable
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
JOIN world AS w ON w.id = i.world_id
JOIN placed_object AS o ON o.world = w.name
JOIN placed_body AS b ON b.object_no = o.object_no AND b.body_no = 0 AND b.role = 'inspected'
    AND w.revision BETWEEN b.first_revision AND coalesce(b.last_revision, w.revision)
JOIN object_variant AS v ON v.id = b.object_variant_id
LEFT JOIN (
    SELECT run_id, occurrence_id >> 28 AS object_no, count(CASE state WHEN 'confirmed' THEN 1 END) AS confirmed,
        count(CASE state WHEN 'changed' THEN 1 END) AS changed,
        count(CASE state WHEN 'contradicted' THEN 1 END) AS contradicted,
        count(CASE state WHEN 'not_confirmed' THEN 1 END) AS not_confirmed,
        count(CASE state WHEN 'undecidable' THEN 1 END) AS undecidable
    FROM presence
    WHERE level <> 'surface'
    GROUP BY run_id, occurrence_id >> 28
) AS c ON c.run_id = i.run_id AND c.object_no = o.object_no;

CREATE VIEW found_state (  -- localisation: What inspections say of parts, features and faces in view, each with the threshold that decided it.
    run_id,  -- the run
    path,  -- path of the part, with the name of the feature or the number of the face
    level,  -- part, feature or surface
    state,  -- confirmed, contradicted, changed, not_confirmed or undecidable
    reason,  -- why, one sentence
    log_odds,  -- natural logarithm of how much likelier the pictures are with it than without it
    threshold,  -- name of the threshold that decided the state; null where no single one did
    threshold_value,  -- its value
    found,  -- what was compared with it
    occurrence_id  -- the placed part
) AS
SELECT s.run_id, s.path, s.level, s.state, s.reason, s.log_odds, t.name AS threshold, t.value AS threshold_value,
    CASE t.name WHEN 'states.least_px' THEN s.distinct_px WHEN 'states.least_expected' THEN s.expected_log_odds
        WHEN 'states.least_log_odds' THEN abs(s.log_odds) WHEN 'states.contradicted_log_odds' THEN abs(s.log_odds)
    END AS found, s.occurrence_id
FROM presence AS s
LEFT JOIN threshold AS t ON t.run_id = s.run_id AND t.decision = 'presence' AND t.name = CASE s.reason
    WHEN 'its edges are found' THEN 'states.least_log_odds'
    WHEN 'some of its edges are found, some are not' THEN 'states.least_log_odds'
    WHEN 'none of its edges is found, which so few may hide' THEN 'states.least_log_odds'
    WHEN 'its edges are found, which may be chance' THEN 'states.least_log_odds'
    WHEN 'its edges are not found, where they would show' THEN
        CASE s.state WHEN 'contradicted' THEN 'states.contradicted_log_odds' ELSE 'states.least_log_odds' END
    WHEN 'little contrast is expected of its edges' THEN 'states.least_expected'
    WHEN 'its edges are too short in the picture' THEN 'states.least_px'
    WHEN 'its edges lie too near to others or to the picture''s border' THEN 'states.least_px'
END;

CREATE VIEW found_size (  -- localisation: What inspections measured, compared with the model: sizes of parts and features, and distances between holes and bosses.
    run_id,  -- the run
    path,  -- path of the part, with the name of the feature or the number of the face
    other_path,  -- of a distance, path of the other feature; null of sizes
    what,  -- as in measured_size: diameter, thickness, width, shift, offset, displacement, distance, ...
    nominal,  -- the model's
    value,  -- the measured one
    difference,  -- value less nominal
    sigma,  -- standard deviation of the measured one
    unit,  -- mm, of a turn deg
    changed  -- whether it is surely another than the model's
) AS
SELECT m.run_id, s.path, o.path AS other_path, m.what, m.nominal, m.value, m.value - m.nominal AS difference,
    m.sigma, m.unit, m.changed
FROM measured_size AS m
JOIN presence AS s ON s.run_id = m.run_id AND s.item_no = m.item_no
LEFT JOIN presence AS o ON o.run_id = m.run_id AND o.item_no = m.other_item_no;

CREATE VIEW camera_history (  -- localisation: What inspections solved of each camera along with the pose, by rig.
    rig_id,  -- the rig
    camera,  -- name of the camera in the rig
    name,  -- response, centre_u, centre_v, focal, x, y, ... as in camera_unknown
    run_id,  -- the run
    began_at,  -- when it began
    verdict,  -- accepted, ambiguous or refused: of the pose
    value,  -- as solved
    difference,  -- that less what was expected before
    sigmas  -- the difference over sigma_shown
) AS
SELECT i.rig_id, u.camera, u.name, u.run_id, r.began_at, i.verdict, u.value, u.value - u.expected AS difference,
    (u.value - u.expected) / u.sigma_shown AS sigmas
FROM camera_unknown AS u
JOIN inspection AS i ON i.run_id = u.run_id
JOIN run AS r ON r.id = u.run_id
WHERE u.sigma > 0;

CREATE VIEW edge_residual (  -- localisation: The edge points that measured a pose, each with its residual and its weight; camera_residual has their mean. Outliers are
    -- among them: any mean is one by weight.
    run_id,  -- the run
    camera,  -- name of the camera in the rig
    path,  -- path of the placed part; this and the next three are null where the view at the pose found shows none of it
    view_kind,  -- sharp, smooth or silhouette
    arc_no,  -- the arc in the shape of the part; null for a silhouette
    surface_no,  -- the surface that a silhouette is of; null for an arc
    u, v,  -- x and y of the edge point, px of the camera freed of distortion
    residual,  -- distance from the projected model arc, px
    sigma,  -- its standard deviation as expected, px
    weight  -- what the point counts for in any mean, 0 to 1
) AS
SELECT m.run_id, v.camera, o.name || n.path AS path, a.kind AS view_kind, a.arc_no, a.surface_no, m.u, m.v, m.residual,
    m.sigma, m.weight
FROM edge_measurement AS m
JOIN inspection_image AS v ON v.run_id = m.run_id AND v.view_no = m.view_no
LEFT JOIN view_arc AS a ON a.run_id = m.run_id AND a.view_no = m.view_no AND a.view_arc_no = m.view_arc_no
LEFT JOIN placed_object AS o ON o.object_no = a.occurrence_id >> 28  -- as placed_node, whose name comes after this view's
LEFT JOIN object_node AS n ON n.object_id = o.object_id AND n.node_no = a.occurrence_id & 268435455;
