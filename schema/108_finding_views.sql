-- Findings: what is not as modelled, each physical thing once, and what persons decided of it; the state of a physical
-- part by all inspections of it.

CREATE TABLE finding_decision (  -- run: What a person decided of a finding; appended, never changed: the newest counts.
    run_id BIGINT PRIMARY KEY,  -- REFERENCES run (id): the run of kind decide that recorded it
    inspection_run_id BIGINT NOT NULL,  -- REFERENCES run (id): the inspection
    item_no INTEGER NOT NULL,  -- the item in it that leads the finding
    decision TEXT NOT NULL,  -- accepted (the part may be used with it) or rejected
    decided_by TEXT NOT NULL,  -- who decided
    note TEXT NOT NULL,  -- why
    CHECK (decision IN ('accepted', 'rejected'))
);

CREATE VIEW current_decision (  -- run: What a person decided last of a finding.
    run_id,  -- the run that recorded it
    inspection_run_id,  -- the inspection
    item_no,  -- the item in it that leads the finding
    decision,  -- accepted or rejected
    decided_by,  -- who
    note  -- why
) AS
SELECT DISTINCT ON (inspection_run_id, item_no) run_id, inspection_run_id, item_no, decision, decided_by, note
FROM finding_decision
ORDER BY inspection_run_id, item_no, run_id DESC;

CREATE VIEW failing (  -- localisation: Parts and features that are changed or contradicted by themselves. A view, since a stage of a query that is asked for twice
    -- is made of all runs.
    run_id,  -- the run
    item_no,  -- the item
    level,  -- part or feature
    occurrence_id,  -- the placed part
    feature_no,  -- feature of its shape; null of a part
    state,  -- changed or contradicted
    strength  -- rank in the run: of several that are one finding the least leads it
) AS
SELECT p.run_id, p.item_no, p.level, p.occurrence_id, p.feature_no, p.state,
    row_number() OVER (
        PARTITION BY p.run_id
        ORDER BY CASE p.level WHEN 'part' THEN 0 ELSE 1 END, CASE WHEN m.sizes > 0 THEN 0 ELSE 1 END,
            coalesce(m.offsets, 0), p.moved_log_odds DESC NULLS LAST, p.visible_pixels DESC, p.item_no
    ) AS strength
FROM presence AS p
LEFT JOIN (
    SELECT run_id, item_no, count(CASE WHEN what <> 'offset' THEN 1 END) AS sizes,
        count(CASE WHEN what = 'offset' THEN 1 END) AS offsets
    FROM measured_size
    WHERE changed AND what <> 'distance'
    GROUP BY run_id, item_no
) AS m ON m.run_id = p.run_id AND m.item_no = p.item_no
-- A part that fails by its features alone is no finding of its own.
WHERE p.level <> 'surface' AND p.state IN ('changed', 'contradicted') AND p.reason <> 'a feature of it is not as modelled';

CREATE VIEW failing_item (  -- localisation: To which finding each part and feature belongs that is changed or contradicted: a feature to its part where that is too,
    -- parts that are displaced as one to the largest, a wall of two features to the one whose size it changes, a bore
    -- that is gone to the boss that is gone with it.
    run_id,  -- the run
    item_no,  -- the item
    lead_no  -- the item that leads the finding
) AS
WITH linked AS (
    SELECT run_id, item_no, strength FROM failing
    UNION ALL
    SELECT a.run_id, a.item_no, b.strength
    FROM failing AS a
    JOIN failing AS b ON b.run_id = a.run_id AND b.occurrence_id = a.occurrence_id AND b.level = 'part'
    UNION ALL
    SELECT a.run_id, a.item_no, b.strength  -- features that are gone and meet, as a boss and its bore
    FROM failing AS a
    JOIN failing AS b ON b.run_id = a.run_id AND b.occurrence_id = a.occurrence_id AND b.item_no <> a.item_no
    JOIN placed_object AS p ON p.object_no = a.occurrence_id >> 28  -- as placed_node, whose name comes after this view's
    JOIN object_node AS o ON o.object_id = p.object_id AND o.node_no = a.occurrence_id & 268435455
    JOIN feature_surface AS f ON f.shape_id = o.shape_id AND f.feature_no = a.feature_no
    JOIN feature_surface AS g ON g.shape_id = o.shape_id AND g.feature_no = b.feature_no
    JOIN shape_arc AS h ON h.shape_id = o.shape_id AND (h.surface_a = f.surface_no AND h.surface_b = g.surface_no
        OR h.surface_a = g.surface_no AND h.surface_b = f.surface_no)
    WHERE a.state = 'contradicted' AND b.state = 'contradicted'
    UNION ALL
    SELECT a.run_id, a.item_no, b.strength  -- a surface that moved is one measure of each feature that it bounds, a displacement of each part
    FROM failing AS a
    JOIN measured_size AS m ON m.run_id = a.run_id AND m.item_no = a.item_no
    JOIN failing AS b ON b.run_id = a.run_id
    JOIN measured_size AS o ON o.run_id = b.run_id AND o.item_no = b.item_no AND o.what = m.what AND o.value = m.value
        AND o.sigma = m.sigma
    WHERE m.what IN ('offset', 'displacement') AND o.what IN ('offset', 'displacement')
        AND (m.changed OR m.what = 'displacement')
),
lead AS (
    SELECT l.run_id, l.item_no, s.item_no AS lead_no
    FROM (SELECT run_id, item_no, min(strength) AS strength FROM linked GROUP BY run_id, item_no) AS l
    JOIN failing AS s ON s.run_id = l.run_id AND s.strength = l.strength
)
SELECT a.run_id, a.item_no, b.lead_no
FROM lead AS a
JOIN lead AS b ON b.run_id = a.run_id AND b.item_no = a.lead_no;

CREATE VIEW difference_limit (  -- localisation: How far measured sizes must differ from the model's to be changed.
    run_id,  -- the run
    measure_no,  -- the size
    least_difference  -- how far it must differ; null of sizes that odds decide
) AS
SELECT m.run_id, m.measure_no,
    CASE WHEN m.what = 'diameter' THEN least(greatest(t.value, d.value * m.sigma), k.value * m.sigma)
        WHEN m.what IN ('shift', 'thickness', 'width') THEN greatest(t.value, k.value * m.sigma) END AS least_difference
FROM measured_size AS m
LEFT JOIN threshold AS t ON t.run_id = m.run_id AND t.decision = 'presence'
    AND t.name = CASE m.what WHEN 'thickness' THEN 'states.changed_wall_mm' ELSE 'states.changed_mm' END
LEFT JOIN threshold AS k ON k.run_id = m.run_id AND k.decision = 'presence' AND k.name = 'states.changed_sigma'
LEFT JOIN threshold AS d ON d.run_id = m.run_id AND d.decision = 'presence' AND d.name = 'states.changed_diameter_sigma';

CREATE VIEW finding (  -- localisation: What is not as modelled, each physical thing once, the worst first, with the size that says so and what a person decided.
    run_id,  -- the run
    finding_no,  -- ordinal in the run, from 1, the worst first
    item_no,  -- the part or feature
    path,  -- its path
    level,  -- part or feature
    occurrence_id,  -- the placed part
    feature_no,  -- feature of its shape; null of a part
    state,  -- contradicted or changed
    reason,  -- why, one sentence
    evidence,  -- natural logarithm of the odds against it being as modelled
    what,  -- the size that differs most surely, as in measured_size; this and the next five are null where none was measured
    nominal,  -- the model's
    value,  -- the measured one
    sigma,  -- standard deviation of that
    unit,  -- mm, of a turn deg
    least_difference,  -- how far it must differ to be changed; null of sizes that odds decide
    together,  -- paths of what is part of the same finding; null where nothing is
    decision,  -- accepted or rejected by a person; this and the next three are null where nobody decided
    decided_by,  -- who
    note,  -- why
    decided_at  -- when
) AS
WITH ranked AS (
    SELECT m.*, row_number() OVER (
        PARTITION BY m.run_id, m.item_no
        ORDER BY CASE WHEN m.changed THEN 0 ELSE 1 END, CASE WHEN m.what = 'offset' THEN 1 ELSE 0 END,
            abs(m.value - m.nominal) / m.sigma DESC, m.measure_no) AS place
    FROM measured_size AS m
    WHERE m.what <> 'distance'
),
grouped AS (
    SELECT g.run_id, g.lead_no,
        string_agg(CASE WHEN g.item_no <> g.lead_no THEN p.path END, ', ' ORDER BY p.item_no) AS together
    FROM failing_item AS g
    JOIN presence AS p ON p.run_id = g.run_id AND p.item_no = g.item_no
    GROUP BY g.run_id, g.lead_no
)
SELECT p.run_id,
    row_number() OVER (
        PARTITION BY p.run_id
        ORDER BY CASE p.state WHEN 'contradicted' THEN 0 ELSE 1 END,
            greatest(-p.log_odds, coalesce(p.moved_log_odds, 0)) DESC, p.item_no) AS finding_no,
    p.item_no, p.path, p.level, p.occurrence_id, p.feature_no, p.state, p.reason,
    greatest(-p.log_odds, coalesce(p.moved_log_odds, 0)) AS evidence, m.what, m.nominal, m.value, m.sigma, m.unit,
    l.least_difference, g.together, d.decision, d.decided_by, d.note, r.began_at AS decided_at
FROM grouped AS g
JOIN presence AS p ON p.run_id = g.run_id AND p.item_no = g.lead_no
LEFT JOIN ranked AS m ON m.run_id = p.run_id AND m.item_no = p.item_no AND m.place = 1
LEFT JOIN difference_limit AS l ON l.run_id = m.run_id AND l.measure_no = m.measure_no  -- whose name comes before this view's
LEFT JOIN current_decision AS d ON d.inspection_run_id = p.run_id AND d.item_no = p.item_no
LEFT JOIN run AS r ON r.id = d.run_id;

CREATE VIEW serial_evidence (  -- localisation: What all inspections of a physical part say of each part and feature that its model has. Of the accepted inspections that
    -- decided it the newest counts that was to see at least half as much of it as the one that was to see most: each state
    -- is one that an inspection decided, with its sizes, a later stop corrects an earlier one, and a glimpse does not.
    serial,  -- the physical part
    world_id,  -- the world that the newest accepted inspection of it had
    occurrence_id,  -- the placed part
    feature_no,  -- feature of its shape; null of a part
    level,  -- part or feature
    path,  -- path of the part, with the name of the feature
    state,  -- as in presence, or not_seen: in no accepted inspection
    reason,  -- why, one sentence; null where it was not seen
    run_id,  -- the inspection that the state is of; null likewise
    item_no,  -- the item in it; null likewise
    stops,  -- how many accepted inspections had it in view
    otherwise,  -- how many of them decided otherwise
    zone  -- where it lies: a letter along the longest side of the whole in eighths, a number along the next in steps as long
) AS
WITH world_of AS (
    SELECT DISTINCT ON (serial) serial, world_id
    FROM inspection
    WHERE serial IS NOT NULL
    ORDER BY serial, CASE verdict WHEN 'accepted' THEN 0 ELSE 1 END, run_id DESC
),
part AS (
    SELECT w.serial, o.*
    FROM world_of AS w
    JOIN occurrence AS o ON o.world_id = w.world_id AND o.kind = 'part'
    JOIN world AS n ON n.id = w.world_id
    JOIN placed_body AS b ON b.object_no = o.object_no AND b.body_no = 0 AND b.role = 'inspected'
        AND n.revision BETWEEN b.first_revision AND coalesce(b.last_revision, n.revision)
),
item AS (
    SELECT serial, world_id, id AS occurrence_id, CAST(NULL AS INTEGER) AS feature_no, 'part' AS level, path,
        (x0 + x1) / 2 AS x, (y0 + y1) / 2 AS y, (z0 + z1) / 2 AS z
    FROM part
    UNION ALL
    SELECT p.serial, p.world_id, p.id, f.feature_no, 'feature', concat(p.path, '/', f.name),
        (p.m00 * (f.x0 + f.x1) + p.m01 * (f.y0 + f.y1) + p.m02 * (f.z0 + f.z1)) / 2 + p.m03,
        (p.m10 * (f.x0 + f.x1) + p.m11 * (f.y0 + f.y1) + p.m12 * (f.z0 + f.z1)) / 2 + p.m13,
        (p.m20 * (f.x0 + f.x1) + p.m21 * (f.y0 + f.y1) + p.m22 * (f.z0 + f.z1)) / 2 + p.m23
    FROM part AS p
    JOIN feature AS f ON f.shape_id = p.shape_id
),
side AS (  -- of the box about the whole: the longest first
    SELECT serial, axis, low, size, row_number() OVER (PARTITION BY serial ORDER BY size DESC, axis) AS place
    FROM (
        SELECT serial, 'x' AS axis, min(x0) AS low, max(x1) - min(x0) AS size FROM part GROUP BY serial
        UNION ALL SELECT serial, 'y', min(y0), max(y1) - min(y0) FROM part GROUP BY serial
        UNION ALL SELECT serial, 'z', min(z0), max(z1) - min(z0) FROM part GROUP BY serial
    ) AS box
),
seen AS (
    SELECT i.serial, p.run_id, p.item_no, p.occurrence_id, p.feature_no, p.level, p.state, p.reason,
        p.expected_log_odds, p.state IN ('confirmed', 'changed', 'contradicted') AS decided,
        max(CASE WHEN p.state IN ('confirmed', 'changed', 'contradicted') THEN p.expected_log_odds END) OVER (
            PARTITION BY i.serial, p.level, p.occurrence_id, p.feature_no) AS most
    FROM inspection AS i
    JOIN presence AS p ON p.run_id = i.run_id AND p.level <> 'surface'
    WHERE i.serial IS NOT NULL AND i.verdict = 'accepted'
),
ranked AS (
    SELECT s.*, count(*) OVER same AS stops,
        count(CASE WHEN decided AND state = 'confirmed' THEN 1 END) OVER same AS passed,
        count(CASE WHEN decided AND state <> 'confirmed' THEN 1 END) OVER same AS failed,
        row_number() OVER (
            PARTITION BY serial, level, occurrence_id, feature_no
            ORDER BY CASE WHEN decided AND expected_log_odds >= 0.5 * most THEN 0 ELSE 1 END,
                CASE WHEN decided AND expected_log_odds >= 0.5 * most THEN run_id END DESC, expected_log_odds DESC,
                run_id DESC
        ) AS place
    FROM seen AS s
    WINDOW same AS (PARTITION BY serial, level, occurrence_id, feature_no)
)
SELECT i.serial, i.world_id, i.occurrence_id, i.feature_no, i.level, i.path, coalesce(r.state, 'not_seen') AS state, r.reason,
    r.run_id, r.item_no, coalesce(r.stops, 0) AS stops,
    CASE r.state WHEN 'confirmed' THEN r.failed WHEN 'changed' THEN r.passed WHEN 'contradicted' THEN r.passed ELSE 0
    END AS otherwise,
    concat(chr(CAST(65 + greatest(least(floor(8 * (CASE a.axis WHEN 'x' THEN i.x WHEN 'y' THEN i.y ELSE i.z END - a.low) / a.size), 7), 0) AS INTEGER)),
        CAST(1 + greatest(floor(8 * (CASE b.axis WHEN 'x' THEN i.x WHEN 'y' THEN i.y ELSE i.z END - b.low) / a.size), 0) AS INTEGER)) AS zone
FROM item AS i
JOIN side AS a ON a.serial = i.serial AND a.place = 1
JOIN side AS b ON b.serial = i.serial AND b.place = 2
LEFT JOIN ranked AS r ON r.serial = i.serial AND r.level = i.level AND r.occurrence_id = i.occurrence_id
    AND r.feature_no IS NOT DISTINCT FROM i.feature_no AND r.place = 1;

CREATE VIEW serial_finding (  -- localisation: The findings of all inspections of a physical part that still count, each physical thing once.
    serial,  -- the physical part
    run_id,  -- the inspection that it is of: the newest that has it
    finding_no  -- the finding in it
) AS
SELECT DISTINCT ON (s.serial, f.path) s.serial, f.run_id, f.finding_no
FROM serial_evidence AS s
JOIN failing_item AS g ON g.run_id = s.run_id AND g.item_no = s.item_no
JOIN finding AS f ON f.run_id = g.run_id AND f.item_no = g.lead_no
ORDER BY s.serial, f.path, f.run_id DESC;

