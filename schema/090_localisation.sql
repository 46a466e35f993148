-- Localisation: predicted views, hypotheses of the rig's pose, correspondences, measurements, and the verdict.

CREATE TABLE inspection (
    run_id BIGINT PRIMARY KEY,
    world_id BIGINT NOT NULL,
    rig_id BIGINT NOT NULL,
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
    prior_covariance DOUBLE PRECISION[] NOT NULL,
    needs_translation_mm DOUBLE PRECISION NOT NULL,
    needs_rotation DOUBLE PRECISION NOT NULL,
    selected_parts INTEGER NOT NULL,
    superfluous_parts INTEGER NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (needs_translation_mm > 0 AND needs_rotation > 0)
);
COMMENT ON TABLE inspection IS 'What an inspection run was given: images, rig and prior; its answer is in pose.';
COMMENT ON COLUMN inspection.run_id IS 'the run';
COMMENT ON COLUMN inspection.world_id IS 'the world, pinned to its revision';
COMMENT ON COLUMN inspection.rig_id IS 'the rig';
COMMENT ON COLUMN inspection.m00 IS 'world_from_rig as the prior has it: row 0, column 0 of the rotation';
COMMENT ON COLUMN inspection.m01 IS 'world_from_rig as the prior has it: row 0, column 1 of the rotation';
COMMENT ON COLUMN inspection.m02 IS 'world_from_rig as the prior has it: row 0, column 2 of the rotation';
COMMENT ON COLUMN inspection.m03 IS 'world_from_rig as the prior has it: row 0 of the translation, mm';
COMMENT ON COLUMN inspection.m10 IS 'world_from_rig as the prior has it: row 1, column 0 of the rotation';
COMMENT ON COLUMN inspection.m11 IS 'world_from_rig as the prior has it: row 1, column 1 of the rotation';
COMMENT ON COLUMN inspection.m12 IS 'world_from_rig as the prior has it: row 1, column 2 of the rotation';
COMMENT ON COLUMN inspection.m13 IS 'world_from_rig as the prior has it: row 1 of the translation, mm';
COMMENT ON COLUMN inspection.m20 IS 'world_from_rig as the prior has it: row 2, column 0 of the rotation';
COMMENT ON COLUMN inspection.m21 IS 'world_from_rig as the prior has it: row 2, column 1 of the rotation';
COMMENT ON COLUMN inspection.m22 IS 'world_from_rig as the prior has it: row 2, column 2 of the rotation';
COMMENT ON COLUMN inspection.m23 IS 'world_from_rig as the prior has it: row 2 of the translation, mm';
COMMENT ON COLUMN inspection.prior_covariance IS '36 numbers, row-major: covariance of the prior, of a right perturbation in the rig''s frame, (t mm, r rad)';
COMMENT ON COLUMN inspection.needs_translation_mm IS 'how exactly the pose was needed: two standard deviations along the worst direction, mm';
COMMENT ON COLUMN inspection.needs_rotation IS 'the same of rotation, rad';
COMMENT ON COLUMN inspection.selected_parts IS 'placed parts that any pose which the prior leaves open could show, by their boxes: nothing else was considered';
COMMENT ON COLUMN inspection.superfluous_parts IS 'how many of them no view holds of the poses sampled on the rim of what the prior leaves open';

CREATE TABLE inspection_image (
    run_id BIGINT NOT NULL,
    camera TEXT NOT NULL,
    image_id BIGINT NOT NULL,
    extraction_id BIGINT NOT NULL,
    PRIMARY KEY (run_id, camera)
);
COMMENT ON TABLE inspection_image IS 'The images of an inspection, one a camera.';
COMMENT ON COLUMN inspection_image.run_id IS 'the run';
COMMENT ON COLUMN inspection_image.camera IS 'name of the camera in the rig';
COMMENT ON COLUMN inspection_image.image_id IS 'its image';
COMMENT ON COLUMN inspection_image.extraction_id IS 'the extraction used';

CREATE TABLE selected_part (
    run_id BIGINT NOT NULL,
    occurrence_id BIGINT NOT NULL,
    shown BOOLEAN NOT NULL,
    PRIMARY KEY (run_id, occurrence_id)
);
COMMENT ON TABLE selected_part IS 'The placed parts that an inspection considered: those that any pose which the prior leaves open could show, by their boxes.';
COMMENT ON COLUMN selected_part.run_id IS 'the run';
COMMENT ON COLUMN selected_part.occurrence_id IS 'the placed part';
COMMENT ON COLUMN selected_part.shown IS 'whether the view of one of the sampled poses holds it too; the others are superfluous as far as that tells';

CREATE TABLE view_arc (
    run_id BIGINT NOT NULL,
    view_no INTEGER NOT NULL,
    view_arc_no INTEGER NOT NULL,
    occurrence_id BIGINT NOT NULL,
    kind TEXT NOT NULL,
    arc_no INTEGER,
    surface_no INTEGER,
    t0 DOUBLE PRECISION,
    t1 DOUBLE PRECISION,
    start_u DOUBLE PRECISION NOT NULL,
    start_v DOUBLE PRECISION NOT NULL,
    end_u DOUBLE PRECISION NOT NULL,
    end_v DOUBLE PRECISION NOT NULL,
    length DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, view_no, view_arc_no),
    CHECK (kind IN ('sharp', 'smooth', 'silhouette')),
    CHECK ((kind = 'silhouette') = (surface_no IS NOT NULL) AND (surface_no IS NULL) = (arc_no IS NOT NULL))
);
COMMENT ON TABLE view_arc IS 'A run of a model arc, or of a silhouette, that a view predicts to be visible.';
COMMENT ON COLUMN view_arc.run_id IS 'the run';
COMMENT ON COLUMN view_arc.view_no IS 'the view';
COMMENT ON COLUMN view_arc.view_arc_no IS 'ordinal in the view, from 0';
COMMENT ON COLUMN view_arc.occurrence_id IS 'the placed part it belongs to';
COMMENT ON COLUMN view_arc.kind IS 'sharp, smooth or silhouette';
COMMENT ON COLUMN view_arc.arc_no IS 'the arc in the part''s shape; null for a silhouette';
COMMENT ON COLUMN view_arc.surface_no IS 'the surface in the part''s shape that a silhouette is of; null for an arc';
COMMENT ON COLUMN view_arc.t0 IS 'start of the visible interval of the arc''s parameter; null for a silhouette';
COMMENT ON COLUMN view_arc.t1 IS 'end of the visible interval';
COMMENT ON COLUMN view_arc.start_u IS 'x of the first end in the image, px of the camera freed of distortion';
COMMENT ON COLUMN view_arc.start_v IS 'y of the first end in the image, px of the camera freed of distortion';
COMMENT ON COLUMN view_arc.end_u IS 'x of the last end in the image, px of the camera freed of distortion';
COMMENT ON COLUMN view_arc.end_v IS 'y of the last end in the image, px of the camera freed of distortion';
COMMENT ON COLUMN view_arc.length IS 'visible length in the image, px';

CREATE TABLE view_surface (
    run_id BIGINT NOT NULL,
    view_no INTEGER NOT NULL,
    view_surface_no INTEGER NOT NULL,
    occurrence_id BIGINT NOT NULL,
    surface_no INTEGER NOT NULL,
    visible_pixels DOUBLE PRECISION NOT NULL,
    centroid_x REAL NOT NULL,
    centroid_y REAL NOT NULL,
    PRIMARY KEY (run_id, view_no, view_surface_no)
);
COMMENT ON TABLE view_surface IS 'A surface that a view predicts to be visible.';
COMMENT ON COLUMN view_surface.run_id IS 'the run';
COMMENT ON COLUMN view_surface.view_no IS 'the view';
COMMENT ON COLUMN view_surface.view_surface_no IS 'ordinal in the view, from 0';
COMMENT ON COLUMN view_surface.occurrence_id IS 'the placed part it belongs to';
COMMENT ON COLUMN view_surface.surface_no IS 'the surface in the part''s shape';
COMMENT ON COLUMN view_surface.visible_pixels IS 'pixels it shows';
COMMENT ON COLUMN view_surface.centroid_x IS 'x of the centroid of what it shows, px';
COMMENT ON COLUMN view_surface.centroid_y IS 'y of the centroid of what it shows, px';

CREATE TABLE hypothesis (
    run_id BIGINT NOT NULL,
    hypothesis_no INTEGER NOT NULL,
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
    cost DOUBLE PRECISION NOT NULL,
    evidence_ratio DOUBLE PRECISION NOT NULL,
    outline_length DOUBLE PRECISION NOT NULL,
    outline_contrast DOUBLE PRECISION NOT NULL,
    outline_evidence DOUBLE PRECISION NOT NULL,
    distance DOUBLE PRECISION NOT NULL,
    relational_distance BIGINT,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (run_id, hypothesis_no)
);
COMMENT ON TABLE hypothesis IS 'A pose of the rig that was considered, refined as far as it was worth.';
COMMENT ON COLUMN hypothesis.run_id IS 'the run';
COMMENT ON COLUMN hypothesis.hypothesis_no IS 'rank in the run, 0 the best';
COMMENT ON COLUMN hypothesis.m00 IS 'world_from_rig: row 0, column 0 of the rotation';
COMMENT ON COLUMN hypothesis.m01 IS 'world_from_rig: row 0, column 1 of the rotation';
COMMENT ON COLUMN hypothesis.m02 IS 'world_from_rig: row 0, column 2 of the rotation';
COMMENT ON COLUMN hypothesis.m03 IS 'world_from_rig: row 0 of the translation, mm';
COMMENT ON COLUMN hypothesis.m10 IS 'world_from_rig: row 1, column 0 of the rotation';
COMMENT ON COLUMN hypothesis.m11 IS 'world_from_rig: row 1, column 1 of the rotation';
COMMENT ON COLUMN hypothesis.m12 IS 'world_from_rig: row 1, column 2 of the rotation';
COMMENT ON COLUMN hypothesis.m13 IS 'world_from_rig: row 1 of the translation, mm';
COMMENT ON COLUMN hypothesis.m20 IS 'world_from_rig: row 2, column 0 of the rotation';
COMMENT ON COLUMN hypothesis.m21 IS 'world_from_rig: row 2, column 1 of the rotation';
COMMENT ON COLUMN hypothesis.m22 IS 'world_from_rig: row 2, column 2 of the rotation';
COMMENT ON COLUMN hypothesis.m23 IS 'world_from_rig: row 2 of the translation, mm';
COMMENT ON COLUMN hypothesis.cost IS 'cost by which hypotheses are ranked; less is better';
COMMENT ON COLUMN hypothesis.evidence_ratio IS 'evidence found in the images over what a right pose would find: about 1 for a right pose, 0 for chance, below 0 for worse than chance';
COMMENT ON COLUMN hypothesis.outline_length IS 'length of the model''s outline against the background in all images, px';
COMMENT ON COLUMN hypothesis.outline_contrast IS 'how much likelier the pixels beside that outline are of their own side than of the other, mean logarithm: 1 to 3 for a right pose, 0 for chance';
COMMENT ON COLUMN hypothesis.outline_evidence IS 'log odds by those pixels that the outline is one; a part of the cost';
COMMENT ON COLUMN hypothesis.distance IS 'Mahalanobis distance from the prior';
COMMENT ON COLUMN hypothesis.relational_distance IS 'what the best labelling of the pictures by what this pose lets them show costs, over all cameras; the margin of the best over a rival is the difference; null where there was no rival, and of those beyond the first two';

-- Without keys, as what pictures give: some 4,000 rows a camera.
CREATE TABLE view_point (
    run_id BIGINT NOT NULL,
    view_no INTEGER NOT NULL,
    view_arc_no INTEGER NOT NULL,
    point_no INTEGER NOT NULL,
    x DECIMAL(9, 2) NOT NULL,
    y DECIMAL(9, 2) NOT NULL,
    direction_x DECIMAL(9, 3) NOT NULL,
    direction_y DECIMAL(9, 3) NOT NULL,
    sigma DECIMAL(9, 3) NOT NULL
);
COMMENT ON TABLE view_point IS 'Where the picture should show the arcs of a view: points along them, the distortion of the camera included.';
COMMENT ON COLUMN view_point.run_id IS 'the run';
COMMENT ON COLUMN view_point.view_no IS 'the view';
COMMENT ON COLUMN view_point.view_arc_no IS 'the arc of the view';
COMMENT ON COLUMN view_point.point_no IS 'ordinal in the view, from 0: the points of an arc follow each other along it';
COMMENT ON COLUMN view_point.x IS 'x, px';
COMMENT ON COLUMN view_point.y IS 'y, px';
COMMENT ON COLUMN view_point.direction_x IS 'x of the unit direction of the arc there';
COMMENT ON COLUMN view_point.direction_y IS 'y of the unit direction of the arc there';
COMMENT ON COLUMN view_point.sigma IS 'standard deviation across the arc that the covariance of the pose and the tolerance of the object make, px';

-- Without keys, as the points.
CREATE TABLE surface_match (
    run_id BIGINT NOT NULL,
    view_no INTEGER NOT NULL,
    view_surface_no INTEGER NOT NULL,
    region_no INTEGER NOT NULL,
    accepted BOOLEAN NOT NULL,
    reason TEXT NOT NULL,
    pixels DOUBLE PRECISION NOT NULL,
    region_share DOUBLE PRECISION NOT NULL,
    surface_share DOUBLE PRECISION NOT NULL,
    CHECK (accepted = (reason = 'assigned'))
);
COMMENT ON TABLE surface_match IS 'Pairs of visible surface and region of the picture that lie on each other, accepted and rejected, at the best hypothesis.';
COMMENT ON COLUMN surface_match.run_id IS 'the run';
COMMENT ON COLUMN surface_match.view_no IS 'the view';
COMMENT ON COLUMN surface_match.view_surface_no IS 'the surface in the view';
COMMENT ON COLUMN surface_match.region_no IS 'the region in the extraction of the view''s camera';
COMMENT ON COLUMN surface_match.accepted IS 'whether the pair was taken';
COMMENT ON COLUMN surface_match.reason IS 'assigned, or why not: overlap (too little of the region lies on the surface), unrelated (its relations are not those of the surface), better_elsewhere';
COMMENT ON COLUMN surface_match.pixels IS 'area that they share, px';
COMMENT ON COLUMN surface_match.region_share IS 'share of the region that lies on the surface';
COMMENT ON COLUMN surface_match.surface_share IS 'share of the visible surface that the region covers';

CREATE TABLE correspondence (
    run_id BIGINT NOT NULL,
    hypothesis_no INTEGER NOT NULL,
    view_no INTEGER NOT NULL,
    view_arc_no INTEGER NOT NULL,
    image_arc_no INTEGER NOT NULL,
    accepted BOOLEAN NOT NULL,
    reason TEXT NOT NULL,
    residual DOUBLE PRECISION NOT NULL,
    gate DOUBLE PRECISION NOT NULL,
    angle DOUBLE PRECISION NOT NULL,
    overlap DOUBLE PRECISION NOT NULL,
    first_point INTEGER NOT NULL,
    last_point INTEGER NOT NULL,
    PRIMARY KEY (run_id, hypothesis_no, view_no, view_arc_no, image_arc_no),
    CHECK (accepted = (reason = 'assigned'))
);
COMMENT ON TABLE correspondence IS 'Pairs of visible model arc and image arc, accepted and rejected, at a hypothesis.';
COMMENT ON COLUMN correspondence.run_id IS 'the run';
COMMENT ON COLUMN correspondence.hypothesis_no IS 'the hypothesis';
COMMENT ON COLUMN correspondence.view_no IS 'the view';
COMMENT ON COLUMN correspondence.view_arc_no IS 'the model arc in the view';
COMMENT ON COLUMN correspondence.image_arc_no IS 'the image arc in the extraction of the view''s camera';
COMMENT ON COLUMN correspondence.accepted IS 'whether the pair was taken';
COMMENT ON COLUMN correspondence.reason IS 'assigned, or why not: orientation, distance, overlap (these three before the search), unrelated (its relations are not those of the model arc), better_elsewhere (another model arc), covered (another image arc lies nearer to the same stretch)';
COMMENT ON COLUMN correspondence.residual IS 'rms distance of the image arc from the projected model arc, px';
COMMENT ON COLUMN correspondence.gate IS 'greatest residual that passes at the uncertainty of pose and arc, px';
COMMENT ON COLUMN correspondence.angle IS 'mean angle between them, rad';
COMMENT ON COLUMN correspondence.overlap IS 'share of the image arc that lies beside the model arc, 0 to 1';
COMMENT ON COLUMN correspondence.first_point IS 'first point_no of the view that it lies beside';
COMMENT ON COLUMN correspondence.last_point IS 'last point_no of the view that it lies beside';

CREATE TABLE edge_measurement (
    run_id BIGINT NOT NULL,
    view_no INTEGER NOT NULL,
    measurement_no INTEGER NOT NULL,
    view_arc_no INTEGER,
    world_x DOUBLE PRECISION NOT NULL,
    world_y DOUBLE PRECISION NOT NULL,
    world_z DOUBLE PRECISION NOT NULL,
    normal_u DOUBLE PRECISION NOT NULL,
    normal_v DOUBLE PRECISION NOT NULL,
    u DOUBLE PRECISION NOT NULL,
    v DOUBLE PRECISION NOT NULL,
    sigma DOUBLE PRECISION NOT NULL,
    weight DOUBLE PRECISION NOT NULL,
    residual DOUBLE PRECISION NOT NULL,
    response DOUBLE PRECISION NOT NULL,
    tolerance DOUBLE PRECISION NOT NULL,
    scene_arc INTEGER NOT NULL,
    stretch INTEGER NOT NULL,
    length DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, view_no, measurement_no)
);
COMMENT ON TABLE edge_measurement IS 'Edge points that the last refinement measured the pose with: enough to replay it. A mean of them is one by weight, as camera_residual has it: outliers are among them.';
COMMENT ON COLUMN edge_measurement.run_id IS 'the run';
COMMENT ON COLUMN edge_measurement.view_no IS 'the view';
COMMENT ON COLUMN edge_measurement.measurement_no IS 'ordinal in the view, from 0';
COMMENT ON COLUMN edge_measurement.view_arc_no IS 'the model arc in the view; null where the view at the pose found shows none of it';
COMMENT ON COLUMN edge_measurement.world_x IS 'x of the model point, mm, in the world''s frame';
COMMENT ON COLUMN edge_measurement.world_y IS 'y of the model point, mm, in the world''s frame';
COMMENT ON COLUMN edge_measurement.world_z IS 'z of the model point, mm, in the world''s frame';
COMMENT ON COLUMN edge_measurement.normal_u IS 'x of the unit normal of the projected arc in the image';
COMMENT ON COLUMN edge_measurement.normal_v IS 'y of the unit normal of the projected arc in the image';
COMMENT ON COLUMN edge_measurement.u IS 'x of the edge point found, px of the camera freed of distortion';
COMMENT ON COLUMN edge_measurement.v IS 'y of the edge point found, px of the camera freed of distortion';
COMMENT ON COLUMN edge_measurement.sigma IS 'standard deviation along the normal, px';
COMMENT ON COLUMN edge_measurement.weight IS 'weight that the robust loss left, 0 to 1: what the point counts for in any mean';
COMMENT ON COLUMN edge_measurement.residual IS 'distance along the normal at the pose of refinement, what was solved of the camera taken off, px; of outliers too, which weigh little';
COMMENT ON COLUMN edge_measurement.response IS 'derivative of the place along the normal by the camera''s response';
COMMENT ON COLUMN edge_measurement.tolerance IS 'standard deviation of where the model has the arc, px';
COMMENT ON COLUMN edge_measurement.scene_arc IS 'number of the arc or outline among all that were selected: measurements of one in a picture may be shifted as a whole';
COMMENT ON COLUMN edge_measurement.stretch IS 'number of the stretch of an arc in a picture whose measurements err together';
COMMENT ON COLUMN edge_measurement.length IS 'length of the arc in the picture that the measurement stands for, px';

CREATE TABLE pose (
    run_id BIGINT PRIMARY KEY,
    verdict TEXT NOT NULL,
    reason TEXT NOT NULL,
    posterior DOUBLE PRECISION NOT NULL,
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
    covariance DOUBLE PRECISION[] NOT NULL,
    singular_values DOUBLE PRECISION[] NOT NULL,
    cost DOUBLE PRECISION NOT NULL,
    margin DOUBLE PRECISION,
    evidence_ratio DOUBLE PRECISION NOT NULL,
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (verdict IN ('accepted', 'ambiguous', 'refused')),
    CHECK (posterior BETWEEN 0 AND 1)
);
COMMENT ON TABLE pose IS 'The verdict of an inspection and the pose of the rig.';
COMMENT ON COLUMN pose.run_id IS 'the run';
COMMENT ON COLUMN pose.verdict IS 'accepted, ambiguous (several poses fit; this one best) or refused';
COMMENT ON COLUMN pose.reason IS 'why, one sentence';
COMMENT ON COLUMN pose.posterior IS 'probability that this pose is the right one';
COMMENT ON COLUMN pose.m00 IS 'world_from_rig: row 0, column 0 of the rotation';
COMMENT ON COLUMN pose.m01 IS 'world_from_rig: row 0, column 1 of the rotation';
COMMENT ON COLUMN pose.m02 IS 'world_from_rig: row 0, column 2 of the rotation';
COMMENT ON COLUMN pose.m03 IS 'world_from_rig: row 0 of the translation, mm';
COMMENT ON COLUMN pose.m10 IS 'world_from_rig: row 1, column 0 of the rotation';
COMMENT ON COLUMN pose.m11 IS 'world_from_rig: row 1, column 1 of the rotation';
COMMENT ON COLUMN pose.m12 IS 'world_from_rig: row 1, column 2 of the rotation';
COMMENT ON COLUMN pose.m13 IS 'world_from_rig: row 1 of the translation, mm';
COMMENT ON COLUMN pose.m20 IS 'world_from_rig: row 2, column 0 of the rotation';
COMMENT ON COLUMN pose.m21 IS 'world_from_rig: row 2, column 1 of the rotation';
COMMENT ON COLUMN pose.m22 IS 'world_from_rig: row 2, column 2 of the rotation';
COMMENT ON COLUMN pose.m23 IS 'world_from_rig: row 2 of the translation, mm';
COMMENT ON COLUMN pose.covariance IS 'covariance of the pose, 6x6 row-major, t in mm then r in rad, right perturbation in the rig frame';
COMMENT ON COLUMN pose.singular_values IS 'singular values of the refinement with 1 mrad scaled against 1 mm';
COMMENT ON COLUMN pose.cost IS 'cost of the best hypothesis';
COMMENT ON COLUMN pose.margin IS 'cost of the next distinct hypothesis less this one; null where there is none';
COMMENT ON COLUMN pose.evidence_ratio IS 'evidence found in the images over what a right pose would find: about 1 for a right pose, 0 for chance, below 0 for worse than chance';

CREATE TABLE base_correction (
    run_id BIGINT PRIMARY KEY,
    world_id BIGINT NOT NULL,
    object_no INTEGER NOT NULL,
    robot TEXT NOT NULL,
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
    shift_x DOUBLE PRECISION NOT NULL,
    shift_y DOUBLE PRECISION NOT NULL,
    shift_z DOUBLE PRECISION NOT NULL,
    turn_x DOUBLE PRECISION NOT NULL,
    turn_y DOUBLE PRECISION NOT NULL,
    turn_z DOUBLE PRECISION NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL,
    prior_covariance DOUBLE PRECISION[],
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);
COMMENT ON TABLE base_correction IS 'Where the base of the arm that carries the rig stands by an accepted pose: of rigs that the world mounts.';
COMMENT ON COLUMN base_correction.run_id IS 'the run';
COMMENT ON COLUMN base_correction.world_id IS 'the world of the inspection';
COMMENT ON COLUMN base_correction.object_no IS 'the object that carries the rig, or has the robot nested in it that does';
COMMENT ON COLUMN base_correction.robot IS 'path of the robot in that object, as in occurrence; empty: the object itself';
COMMENT ON COLUMN base_correction.m00 IS 'world_from_base, corrected: row 0, column 0 of the rotation';
COMMENT ON COLUMN base_correction.m01 IS 'world_from_base, corrected: row 0, column 1 of the rotation';
COMMENT ON COLUMN base_correction.m02 IS 'world_from_base, corrected: row 0, column 2 of the rotation';
COMMENT ON COLUMN base_correction.m03 IS 'world_from_base, corrected: row 0 of the translation, mm';
COMMENT ON COLUMN base_correction.m10 IS 'world_from_base, corrected: row 1, column 0 of the rotation';
COMMENT ON COLUMN base_correction.m11 IS 'world_from_base, corrected: row 1, column 1 of the rotation';
COMMENT ON COLUMN base_correction.m12 IS 'world_from_base, corrected: row 1, column 2 of the rotation';
COMMENT ON COLUMN base_correction.m13 IS 'world_from_base, corrected: row 1 of the translation, mm';
COMMENT ON COLUMN base_correction.m20 IS 'world_from_base, corrected: row 2, column 0 of the rotation';
COMMENT ON COLUMN base_correction.m21 IS 'world_from_base, corrected: row 2, column 1 of the rotation';
COMMENT ON COLUMN base_correction.m22 IS 'world_from_base, corrected: row 2, column 2 of the rotation';
COMMENT ON COLUMN base_correction.m23 IS 'world_from_base, corrected: row 2 of the translation, mm';
COMMENT ON COLUMN base_correction.shift_x IS 'how far the base''s origin is from where the world has it, along the world''s x, mm';
COMMENT ON COLUMN base_correction.shift_y IS 'how far the base''s origin is from where the world has it, along the world''s y, mm';
COMMENT ON COLUMN base_correction.shift_z IS 'how far the base''s origin is from where the world has it, along the world''s z, mm';
COMMENT ON COLUMN base_correction.turn_x IS 'x of the rotation vector from the base as the world has it, in its frame, rad';
COMMENT ON COLUMN base_correction.turn_y IS 'y of the rotation vector from the base as the world has it, in its frame, rad';
COMMENT ON COLUMN base_correction.turn_z IS 'z of the rotation vector from the base as the world has it, in its frame, rad';
COMMENT ON COLUMN base_correction.covariance IS '36 numbers, row-major: covariance of the base, of a right perturbation in its frame, (t mm, r rad)';
COMMENT ON COLUMN base_correction.prior_covariance IS 'the same of the base where the world has it, as given; null: it could stand anywhere';

CREATE TABLE joint_correction (
    run_id BIGINT NOT NULL,
    joint TEXT NOT NULL,
    stated_value DOUBLE PRECISION NOT NULL,
    prior_sigma DOUBLE PRECISION,
    value DOUBLE PRECISION NOT NULL,
    sigma DOUBLE PRECISION,
    PRIMARY KEY (run_id, joint),
    CHECK (prior_sigma > 0 AND sigma > 0),
    CHECK ((prior_sigma IS NULL) = (sigma IS NULL))
);
COMMENT ON TABLE joint_correction IS 'The joints with which the base was corrected: held, or corrected along with it.';
COMMENT ON COLUMN joint_correction.run_id IS 'the run';
COMMENT ON COLUMN joint_correction.joint IS 'name of the joint; fixed joints are left out';
COMMENT ON COLUMN joint_correction.stated_value IS 'its value as the world has it, or the call gave it, rad or mm';
COMMENT ON COLUMN joint_correction.prior_sigma IS 'standard deviation of that, rad or mm; null where the joint is held, or follows another';
COMMENT ON COLUMN joint_correction.value IS 'its corrected value, rad or mm';
COMMENT ON COLUMN joint_correction.sigma IS 'standard deviation of that, rad or mm; null where the joint is held, or follows another';

CREATE TABLE part_in_view (
    run_id BIGINT NOT NULL,
    in_view_no INTEGER NOT NULL,
    occurrence_id BIGINT NOT NULL,
    feature_no INTEGER,
    level TEXT NOT NULL,
    path TEXT NOT NULL,
    visible_pixels DOUBLE PRECISION NOT NULL,
    covered_pixels DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, in_view_no),
    CHECK (level IN ('part', 'feature')),
    CHECK ((level = 'feature') = (feature_no IS NOT NULL)),
    CHECK (visible_pixels >= 0 AND covered_pixels > 0)
);
COMMENT ON TABLE part_in_view IS 'Placed parts and features that the cameras see at the pose found.';
COMMENT ON COLUMN part_in_view.run_id IS 'the run';
COMMENT ON COLUMN part_in_view.in_view_no IS 'ordinal in the run, from 0';
COMMENT ON COLUMN part_in_view.occurrence_id IS 'the placed part';
COMMENT ON COLUMN part_in_view.feature_no IS 'feature of its shape; null for the part as a whole';
COMMENT ON COLUMN part_in_view.level IS 'part or feature';
COMMENT ON COLUMN part_in_view.path IS 'path of the part, with the name of the feature';
COMMENT ON COLUMN part_in_view.visible_pixels IS 'pixels it shows, over all cameras';
COMMENT ON COLUMN part_in_view.covered_pixels IS 'pixels it would cover unoccluded';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('inspection', 'localisation', 'primary'),
    ('inspection_image', 'localisation', 'primary'),
    ('selected_part', 'localisation', 'primary'),
    ('view_arc', 'localisation', 'primary'),
    ('view_surface', 'localisation', 'primary'),
    ('hypothesis', 'localisation', 'primary'),
    ('view_point', 'localisation', 'primary'),
    ('surface_match', 'localisation', 'primary'),
    ('correspondence', 'localisation', 'primary'),
    ('edge_measurement', 'localisation', 'primary'),
    ('pose', 'localisation', 'primary'),
    ('base_correction', 'localisation', 'primary'),
    ('joint_correction', 'localisation', 'primary'),
    ('part_in_view', 'localisation', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('inspection', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('inspection', 1, ARRAY['world_id'], 'world', ARRAY['id']),
    ('inspection', 2, ARRAY['rig_id'], 'rig', ARRAY['id']),
    ('inspection_image', 0, ARRAY['run_id'], 'inspection', ARRAY['run_id']),
    ('inspection_image', 1, ARRAY['image_id'], 'image', ARRAY['id']),
    ('inspection_image', 2, ARRAY['extraction_id'], 'extraction', ARRAY['id']),
    ('selected_part', 0, ARRAY['run_id'], 'inspection', ARRAY['run_id']),
    ('view_arc', 0, ARRAY['run_id', 'view_no'], 'view', ARRAY['run_id', 'view_no']),
    ('view_surface', 0, ARRAY['run_id', 'view_no'], 'view', ARRAY['run_id', 'view_no']),
    ('hypothesis', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('view_point', 0, ARRAY['run_id', 'view_no', 'view_arc_no'], 'view_arc', ARRAY['run_id', 'view_no', 'view_arc_no']),
    ('surface_match', 0, ARRAY['run_id', 'view_no', 'view_surface_no'], 'view_surface', ARRAY['run_id', 'view_no', 'view_surface_no']),
    ('correspondence', 0, ARRAY['run_id', 'hypothesis_no'], 'hypothesis', ARRAY['run_id', 'hypothesis_no']),
    ('correspondence', 1, ARRAY['run_id', 'view_no', 'view_arc_no'], 'view_arc', ARRAY['run_id', 'view_no', 'view_arc_no']),
    ('edge_measurement', 0, ARRAY['run_id', 'view_no', 'view_arc_no'], 'view_arc', ARRAY['run_id', 'view_no', 'view_arc_no']),
    ('pose', 0, ARRAY['run_id'], 'inspection', ARRAY['run_id']),
    ('base_correction', 0, ARRAY['run_id'], 'pose', ARRAY['run_id']),
    ('base_correction', 1, ARRAY['world_id'], 'world', ARRAY['id']),
    ('base_correction', 2, ARRAY['object_no'], 'placed_object', ARRAY['object_no']),
    ('joint_correction', 0, ARRAY['run_id'], 'base_correction', ARRAY['run_id']),
    ('part_in_view', 0, ARRAY['run_id'], 'run', ARRAY['id']);
