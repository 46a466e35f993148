-- Localisation: predicted views, hypotheses of the rig's pose, correspondences, measurements, and the verdict.

CREATE TABLE inspection (  -- localisation: What an inspection run was given, images, rig and prior, and its verdict; pose has the pose.
    run_id BIGINT PRIMARY KEY,  -- REFERENCES run (id): the run
    world_id BIGINT NOT NULL,  -- REFERENCES world (id): the world, pinned to its revision
    rig_id BIGINT NOT NULL,  -- REFERENCES rig (id): the rig
    serial TEXT,  -- serial number of the physical part that was inspected; null where none was given
    m00 DOUBLE PRECISION, m01 DOUBLE PRECISION, m02 DOUBLE PRECISION, m03 DOUBLE PRECISION,  -- world_from_rig as the prior has it; null where there is none
    m10 DOUBLE PRECISION, m11 DOUBLE PRECISION, m12 DOUBLE PRECISION, m13 DOUBLE PRECISION,
    m20 DOUBLE PRECISION, m21 DOUBLE PRECISION, m22 DOUBLE PRECISION, m23 DOUBLE PRECISION,
    prior_covariance DOUBLE PRECISION[],  -- 36 numbers, row-major: covariance of the prior, of a right perturbation in the rig's frame, (t
        -- mm, r rad); null likewise
    needs_translation_mm DOUBLE PRECISION NOT NULL,  -- how exactly the pose was needed: two standard deviations along the worst direction, mm
    needs_rotation DOUBLE PRECISION NOT NULL,  -- the same of rotation, rad
    verdict TEXT NOT NULL,  -- accepted, ambiguous (several poses fit; the best hypothesis best) or refused
    reason TEXT NOT NULL,  -- why, one sentence
    posterior DOUBLE PRECISION NOT NULL,  -- probability that the best hypothesis is the right one
    covariance DOUBLE PRECISION[],  -- covariance of the best hypothesis, as prior_covariance; null where there is none
    singular_values DOUBLE PRECISION[],  -- singular values of its refinement with 1 mrad scaled against 1 mm; null likewise
    weakest TEXT,  -- the directions in which it is known worst, in words; null likewise
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    CHECK (needs_translation_mm > 0 AND needs_rotation > 0),
    CHECK (verdict IN ('accepted', 'ambiguous', 'refused')),
    CHECK (posterior BETWEEN 0 AND 1)
);

CREATE TABLE inspection_sentence (  -- localisation: What an inspection says beside its verdict.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    sentence_no INTEGER NOT NULL,  -- ordinal in the run, from 0
    kind TEXT NOT NULL,  -- missing (for the pose to be accepted), note (what was taken for given that the inputs do not say) or rig (how the
        -- pictures say that the rig is, where not as its file says)
    sentence TEXT NOT NULL,  -- one sentence
    PRIMARY KEY (run_id, sentence_no),
    CHECK (kind IN ('missing', 'note', 'rig'))
);

CREATE TABLE inspection_image (  -- localisation: The images of an inspection, one a camera, and the view of the model that is predicted for it at the pose found.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    camera TEXT NOT NULL,  -- name of the camera in the rig
    camera_no INTEGER NOT NULL,  -- ordinal of the camera in the run, from 0, in the order of the rig's file
    image_id BIGINT NOT NULL,  -- REFERENCES image (id): its image
    extraction_id BIGINT NOT NULL,  -- REFERENCES extraction (id): the extraction used
    view_no INTEGER,  -- ordinal of the view in the run, from 0; null where no pose was found, the run kept only its decisions, or answered without this
        -- camera
    edges DOUBLE PRECISION NOT NULL,  -- edge elements to a thousand pixels: next to none where the camera is covered
    blur_px DOUBLE PRECISION,  -- sigma of the spread of its strong edges, px; null where it has too few
    saturated DOUBLE PRECISION NOT NULL,  -- share of the pixels at the brightest value; where it passes the limit, of those that show the model found
    mosaic DOUBLE PRECISION NOT NULL,  -- grey by which the pixels of one diagonal of two by two differ from the other: of a raw Bayer mosaic
    stale_run_id BIGINT,  -- REFERENCES run (id): an earlier run that had this picture of this camera beside another picture of another; this run where two cameras were
        -- given one picture; null where neither is so
    PRIMARY KEY (run_id, camera),
    UNIQUE (run_id, view_no)
);

CREATE TABLE selected_part (  -- localisation: The placed parts that an inspection considered: those that any pose which the prior leaves open could show, by their
    -- boxes, and no others.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    occurrence_id BIGINT NOT NULL,  -- the placed part
    shown BOOLEAN NOT NULL,  -- whether the view of one of the sampled poses holds it too; the others are superfluous as far as that tells
    PRIMARY KEY (run_id, occurrence_id)
);

CREATE TABLE view_arc (  -- localisation: A run of a model arc, or of a silhouette, that a view predicts to be visible.
    run_id BIGINT NOT NULL,  -- the run
    view_no INTEGER NOT NULL,  -- REFERENCES inspection_image (run_id, view_no): the view
    view_arc_no INTEGER NOT NULL,  -- ordinal in the view, from 0
    occurrence_id BIGINT NOT NULL,  -- the placed part it belongs to
    kind TEXT NOT NULL,  -- sharp, smooth or silhouette
    arc_no INTEGER,  -- the arc in the part's shape; null for a silhouette
    surface_no INTEGER,  -- the surface in the part's shape that a silhouette is of; null for an arc
    length DOUBLE PRECISION NOT NULL,  -- visible length in the image, px
    distinct_px DOUBLE PRECISION,  -- of that, what can be distinguished from other edges and from the border of the picture; null, as what
        -- follows, where the run took no account of its edges, and for blends
    supported_px DOUBLE PRECISION,  -- of that, what edge elements support
    shows DOUBLE PRECISION,  -- probability that such an edge shows in this picture, by alike edges elsewhere in it
    log_odds DOUBLE PRECISION,  -- natural logarithm of how much likelier what was found of it is with the edge there than without
    PRIMARY KEY (run_id, view_no, view_arc_no),
    CHECK (kind IN ('sharp', 'smooth', 'silhouette')),
    CHECK ((kind = 'silhouette') = (surface_no IS NOT NULL) AND (surface_no IS NULL) = (arc_no IS NOT NULL))
);

CREATE TABLE view_surface (  -- localisation: A surface that a view predicts to be visible.
    run_id BIGINT NOT NULL,  -- the run
    view_no INTEGER NOT NULL,  -- REFERENCES inspection_image (run_id, view_no): the view
    view_surface_no INTEGER NOT NULL,  -- ordinal in the view, from 0
    occurrence_id BIGINT NOT NULL,  -- the placed part it belongs to
    surface_no INTEGER NOT NULL,  -- the surface in the part's shape
    PRIMARY KEY (run_id, view_no, view_surface_no)
);

CREATE TABLE hypothesis (  -- localisation: A pose of the rig that was considered, refined roughly or in full.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run
    hypothesis_no INTEGER NOT NULL,  -- rank in the run, 0 the best
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_rig
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    cost DOUBLE PRECISION NOT NULL,  -- cost by which hypotheses are ranked; less is better
    evidence_ratio DOUBLE PRECISION NOT NULL,  -- evidence found in the images over what a right pose would find: about 1 for a right pose, 0 for
        -- chance, below 0 for worse than chance
    outline_length DOUBLE PRECISION NOT NULL,  -- length of the model's outline against the background in all images, px
    outline_contrast DOUBLE PRECISION NOT NULL,  -- how much likelier the pixels next to that outline are of their own side than of the other, mean
        -- logarithm: 1 to 3 for a right pose, 0 for chance
    outline_evidence DOUBLE PRECISION NOT NULL,  -- log odds by those pixels that the outline is one; a part of the cost
    distance DOUBLE PRECISION,  -- Mahalanobis distance from the prior; null where there is none
    is_symmetric BOOLEAN NOT NULL,  -- whether a symmetry of the model leads here from the best: no rival, since nothing tells them apart
    account_log_odds DOUBLE PRECISION,  -- log odds of all edges seen from here, by the account of edges; null where there was no rival, or too many
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6),
    PRIMARY KEY (run_id, hypothesis_no)
);

-- Without keys, as what pictures give: some 4,000 rows a camera.
CREATE TABLE view_point (  -- localisation: Where the picture should show the arcs of a view: points along them, the distortion of the camera included.
    run_id BIGINT NOT NULL,  -- the run
    view_no INTEGER NOT NULL,  -- the view
    view_arc_no INTEGER NOT NULL,  -- REFERENCES view_arc (run_id, view_no, view_arc_no): the arc of the view
    point_no INTEGER NOT NULL,  -- ordinal in the view, from 0: the points of an arc follow each other along it
    x DECIMAL(9, 2) NOT NULL, y DECIMAL(9, 2) NOT NULL,  -- x and y, px
    direction_x DECIMAL(9, 3) NOT NULL, direction_y DECIMAL(9, 3) NOT NULL,  -- x and y of the unit direction of the arc there
    sigma DECIMAL(9, 3) NOT NULL  -- standard deviation across the arc that the covariance of the pose and the tolerance of the object make, px
);

-- Without keys, as the points.
CREATE TABLE surface_match (  -- localisation: Pairs of visible surface and region of the picture that lie on each other, accepted and rejected, at the best
    -- hypothesis.
    run_id BIGINT NOT NULL,  -- the run
    view_no INTEGER NOT NULL,  -- the view
    view_surface_no INTEGER NOT NULL,  -- REFERENCES view_surface (run_id, view_no, view_surface_no): the surface in the view
    region_no INTEGER NOT NULL,  -- the region in the extraction of the view's camera
    accepted BOOLEAN NOT NULL,  -- whether the pair was taken
    reason TEXT NOT NULL,  -- assigned, or why not: overlap (too little of the region lies on the surface), unrelated (its relations are not those of
        -- the surface), better_elsewhere
    pixels DOUBLE PRECISION NOT NULL,  -- area that they share, px
    region_share DOUBLE PRECISION NOT NULL,  -- share of the region that lies on the surface
    surface_share DOUBLE PRECISION NOT NULL,  -- share of the visible surface that the region covers
    CHECK (accepted = (reason = 'assigned'))
);

CREATE TABLE correspondence (  -- localisation: Pairs of visible model arc and image arc, accepted and rejected, at a hypothesis.
    run_id BIGINT NOT NULL,  -- the run
    hypothesis_no INTEGER NOT NULL,  -- REFERENCES hypothesis (run_id, hypothesis_no): the hypothesis
    view_no INTEGER NOT NULL,  -- the view
    view_arc_no INTEGER NOT NULL,  -- REFERENCES view_arc (run_id, view_no, view_arc_no): the model arc in the view
    image_arc_no INTEGER NOT NULL,  -- the image arc in the extraction of the view's camera
    accepted BOOLEAN NOT NULL,  -- whether the pair was taken
    reason TEXT NOT NULL,  -- assigned, or why not: orientation, distance, overlap (these three before the search), unrelated (its relations are not
        -- those of the model arc), better_elsewhere (another model arc), covered (another image arc lies nearer to the same stretch)
    residual DOUBLE PRECISION NOT NULL,  -- rms distance of the image arc from the projected model arc, px
    gate DOUBLE PRECISION NOT NULL,  -- greatest residual that passes at the uncertainty of pose and arc, px
    angle DOUBLE PRECISION NOT NULL,  -- mean angle between them, rad
    angle_gate DOUBLE PRECISION NOT NULL,  -- greatest such angle that passes: of a small circle, what the pose may turn it by, rad
    overlap DOUBLE PRECISION NOT NULL,  -- share of the image arc that lies along the model arc, 0 to 1
    first_point INTEGER NOT NULL,  -- first point_no of the view that it lies along
    last_point INTEGER NOT NULL,  -- last point_no of the view that it lies along
    PRIMARY KEY (run_id, hypothesis_no, view_no, view_arc_no, image_arc_no),
    CHECK (accepted = (reason = 'assigned'))
);

CREATE TABLE edge_measurement (  -- localisation: Edge points that the last refinement measured the pose with. A mean of them is one by weight, as camera_residual has
    -- it: outliers are among them.
    run_id BIGINT NOT NULL,  -- the run
    view_no INTEGER NOT NULL,  -- the view
    measurement_no INTEGER NOT NULL,  -- ordinal in the view, from 0
    view_arc_no INTEGER,  -- REFERENCES view_arc (run_id, view_no, view_arc_no): the model arc in the view; null where the view at the pose found shows none of it
    world_x DOUBLE PRECISION NOT NULL, world_y DOUBLE PRECISION NOT NULL, world_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the model point, mm, in the world's frame
    normal_u DOUBLE PRECISION NOT NULL, normal_v DOUBLE PRECISION NOT NULL,  -- x and y of the unit normal of the projected arc in the image
    u DOUBLE PRECISION NOT NULL, v DOUBLE PRECISION NOT NULL,  -- x and y of the edge point found, px of the camera freed of distortion
    sigma DOUBLE PRECISION NOT NULL,  -- standard deviation along the normal, px
    weight DOUBLE PRECISION NOT NULL,  -- weight that the robust loss left, 0 to 1: what the point counts for in any mean
    residual DOUBLE PRECISION NOT NULL,  -- distance along the normal at the pose of refinement, what was solved of the camera taken off, px; of
        -- outliers too, which weigh little
    response DOUBLE PRECISION NOT NULL,  -- derivative of the place along the normal by the camera's response
    arc_shift DOUBLE PRECISION NOT NULL,  -- standard deviation by which the image of its arc is shifted as a whole, px
    scene_arc INTEGER NOT NULL,  -- number of the arc or outline among all that were selected: measurements of one in a picture may be shifted as a
        -- whole
    PRIMARY KEY (run_id, view_no, measurement_no)
);

CREATE VIEW pose (  -- localisation: The verdict of an inspection and the pose of the rig: the best hypothesis, or the prior where there is none.
    run_id,  -- the run
    verdict,  -- accepted, ambiguous (several poses fit; this one best) or refused
    reason,  -- why, one sentence
    posterior,  -- probability that this pose is the right one
    m00, m01, m02, m03,  -- world_from_rig
    m10, m11, m12, m13,
    m20, m21, m22, m23,
    covariance,  -- covariance of the pose, 6x6 row-major, t in mm then r in rad, right perturbation in the rig frame
    singular_values,  -- singular values of the refinement with 1 mrad scaled against 1 mm
    cost,  -- cost of the best hypothesis; 0 where there is none
    margin,  -- cost of the next distinct hypothesis less this one; null where there is none
    evidence_ratio  -- evidence found in the images over what a right pose would find: about 1 for a right pose, 0 for chance, below 0 for worse
        -- than chance
) AS
SELECT i.run_id, i.verdict, i.reason, i.posterior,
    coalesce(h.m00, i.m00) AS m00, coalesce(h.m01, i.m01) AS m01, coalesce(h.m02, i.m02) AS m02, coalesce(h.m03, i.m03) AS m03,
    coalesce(h.m10, i.m10) AS m10, coalesce(h.m11, i.m11) AS m11, coalesce(h.m12, i.m12) AS m12, coalesce(h.m13, i.m13) AS m13,
    coalesce(h.m20, i.m20) AS m20, coalesce(h.m21, i.m21) AS m21, coalesce(h.m22, i.m22) AS m22, coalesce(h.m23, i.m23) AS m23,
    coalesce(i.covariance, i.prior_covariance) AS covariance, i.singular_values, coalesce(h.cost, 0) AS cost,
    (SELECT min(o.cost) FROM hypothesis AS o WHERE o.run_id = i.run_id AND o.hypothesis_no > 0) - h.cost AS margin,
    coalesce(h.evidence_ratio, 0) AS evidence_ratio
FROM inspection AS i
LEFT JOIN hypothesis AS h ON h.run_id = i.run_id AND h.hypothesis_no = 0;

CREATE TABLE base_correction (  -- localisation: Where the bases of the arms that carry rigs stand by an accepted pose: of rigs that the world mounts.
    run_id BIGINT NOT NULL,  -- REFERENCES inspection (run_id): the run
    base_no INTEGER NOT NULL,  -- ordinal in the run, from 0: the first's pose is the answer's
    object_no INTEGER NOT NULL,  -- REFERENCES placed_object (object_no): the object that carries the rig, or has the robot nested in it that does
    robot TEXT NOT NULL,  -- path of the robot in that object, as in occurrence; empty: the object itself
    m00 DOUBLE PRECISION NOT NULL, m01 DOUBLE PRECISION NOT NULL, m02 DOUBLE PRECISION NOT NULL, m03 DOUBLE PRECISION NOT NULL,  -- world_from_base, corrected
    m10 DOUBLE PRECISION NOT NULL, m11 DOUBLE PRECISION NOT NULL, m12 DOUBLE PRECISION NOT NULL, m13 DOUBLE PRECISION NOT NULL,
    m20 DOUBLE PRECISION NOT NULL, m21 DOUBLE PRECISION NOT NULL, m22 DOUBLE PRECISION NOT NULL, m23 DOUBLE PRECISION NOT NULL,
    shift_x DOUBLE PRECISION NOT NULL, shift_y DOUBLE PRECISION NOT NULL, shift_z DOUBLE PRECISION NOT NULL,  -- how far the base's origin is from where the world has it, along the world's x, y and z, mm
    turn_x DOUBLE PRECISION NOT NULL, turn_y DOUBLE PRECISION NOT NULL, turn_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the rotation vector from the base as the world has it, in its frame, rad
    covariance DOUBLE PRECISION[] NOT NULL,  -- 36 numbers, row-major: covariance of the base, of a right perturbation in its frame, (t mm, r rad)
    PRIMARY KEY (run_id, base_no),
    CHECK (abs(m00 * m00 + m10 * m10 + m20 * m20 - 1) < 1e-6 AND abs(m01 * m01 + m11 * m11 + m21 * m21 - 1) < 1e-6
        AND abs(m00 * m01 + m10 * m11 + m20 * m21) < 1e-6
        AND abs(m02 - (m10 * m21 - m20 * m11)) < 1e-6 AND abs(m12 - (m20 * m01 - m00 * m21)) < 1e-6
        AND abs(m22 - (m00 * m11 - m10 * m01)) < 1e-6)
);

CREATE TABLE joint_correction (  -- localisation: The joints with which the base was corrected: fixed, or corrected along with it.
    run_id BIGINT NOT NULL,  -- the run
    base_no INTEGER NOT NULL,  -- REFERENCES base_correction (run_id, base_no): the base of the arm
    joint TEXT NOT NULL,  -- name of the joint; fixed joints are left out
    stated_value DOUBLE PRECISION NOT NULL,  -- its value as the world has it, or the call gave it, rad or mm
    prior_sigma DOUBLE PRECISION,  -- standard deviation of that, rad or mm; null where the joint is fixed, or follows another
    value DOUBLE PRECISION NOT NULL,  -- its corrected value, rad or mm
    sigma DOUBLE PRECISION,  -- standard deviation of that, rad or mm; null where the joint is fixed, or follows another
    unit TEXT NOT NULL,  -- of all these, mm or rad
    PRIMARY KEY (run_id, base_no, joint),
    CHECK (prior_sigma > 0 AND sigma > 0),
    CHECK ((prior_sigma IS NULL) = (sigma IS NULL))
);

CREATE TABLE part_in_view (  -- localisation: Placed parts and features that the cameras see at the pose found.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run
    in_view_no INTEGER NOT NULL,  -- ordinal in the run, from 0
    occurrence_id BIGINT NOT NULL,  -- the placed part
    feature_no INTEGER,  -- feature of its shape; null for the part as a whole
    level TEXT NOT NULL,  -- part or feature
    path TEXT NOT NULL,  -- path of the part, with the name of the feature
    visible_pixels DOUBLE PRECISION NOT NULL,  -- pixels it shows, over all cameras
    covered_pixels DOUBLE PRECISION NOT NULL,  -- pixels it would cover unoccluded
    PRIMARY KEY (run_id, in_view_no),
    CHECK (level IN ('part', 'feature')),
    CHECK ((level = 'feature') = (feature_no IS NOT NULL)),
    CHECK (visible_pixels >= 0 AND covered_pixels > 0)
);
