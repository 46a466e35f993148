-- Characteristics: sizes of parts with limits, and what is decided of each. A view reads only those whose names come before its own.

CREATE TABLE size_tolerance (  -- part: Limits of sizes of a part that a person's file states; appended, never changed: of a part the newest run counts, whole.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that stated it
    part_id BIGINT NOT NULL,  -- REFERENCES part (id): the part
    item TEXT NOT NULL,  -- what of the part: name of a feature, or face and its number, as in presence.path; empty: the part itself
    what TEXT NOT NULL,  -- as in bounded_size
    nominal DOUBLE PRECISION NOT NULL,  -- nominal value, mm, or 1 of counts
    lower_limit DOUBLE PRECISION, upper_limit DOUBLE PRECISION,  -- least and greatest value that it may have; null where it is not bounded
    PRIMARY KEY (run_id, part_id, item, what),
    CHECK (lower_limit <= upper_limit)
);

CREATE VIEW bounded_size (  -- part: The sizes of a part that inspections can measure, with the limits of its CAD file, else of the newest file of tolerances.
    part_id, item,  -- the part, and what of it, as in size_tolerance
    what,  -- diameter, counterbore_diameter, bore_diameter, thickness, length or width (of pockets), count (of holes of a pattern), shift (how far aside it is),
        -- presence (1: it is there), or offset (how far outward a face lies)
    nominal, lower_limit, upper_limit,  -- nominal, least and greatest value, mm, or 1 of counts; null where it is not bounded
    source  -- where the limits come from: file (PMI of the CAD file, the narrowest), user, or null where neither states any
) AS
WITH named AS (
    SELECT p.id AS part_id, f.name AS item, d.name AS what, d.value AS nominal, f.shape_id, f.feature_no
    FROM part AS p
    JOIN feature AS f ON f.shape_id = p.shape_id
    JOIN feature_class AS k ON k.id = f.feature_class_id
    JOIN (SELECT feature_class_id, name, value FROM feature_dimension
        UNION ALL SELECT id, unnest(ARRAY['shift', 'presence']), unnest(ARRAY[0, 1]) FROM feature_class) AS d ON d.feature_class_id = k.id
    WHERE d.name IN ('count', 'shift', 'presence') OR d.name = 'thickness' AND k.kind IN ('rib', 'web') OR d.name IN ('length', 'width') AND k.kind = 'pocket'
        OR d.name IN ('diameter', 'counterbore_diameter', 'bore_diameter') AND k.kind IN ('through_hole', 'blind_hole', 'boss', 'lug', 'flange')
    UNION ALL SELECT p.id, 'face ' || CAST(s.surface_no AS TEXT), 'offset', 0, NULL, NULL FROM part AS p JOIN shape_surface AS s ON s.shape_id = p.shape_id
    UNION ALL SELECT id, '', 'presence', 1, NULL, NULL FROM part
),
stated AS (  -- by PMI of its faces; by a distance of two faces where the feature has both
    SELECT n.part_id, n.item, n.what, max(m.times * m.lower_limit) AS lower_limit, min(m.times * m.upper_limit) AS upper_limit
    FROM named AS n
    JOIN feature_surface AS f ON f.shape_id = n.shape_id AND f.feature_no = n.feature_no
    JOIN part_pmi_surface AS r ON r.part_id = n.part_id AND r.surface_no = f.surface_no
    JOIN (SELECT *, CASE type WHEN 'radius' THEN 2 ELSE 1 END AS times FROM part_pmi WHERE kind = 'dimension' AND unit = 'mm') AS m
        ON m.part_id = r.part_id AND m.pmi_no = r.pmi_no AND abs(m.times * m.value - n.nominal) < 0.005 AND (m.type IN ('diameter', 'radius')) = (right(n.what, 8) = 'diameter')
    WHERE coalesce(m.lower_limit, m.upper_limit) IS NOT NULL AND n.what NOT IN ('count', 'shift', 'presence')
    GROUP BY n.part_id, n.item, n.what HAVING min(r.role) = 'feature' OR count(DISTINCT r.role) = 2
)
SELECT n.part_id, n.item, n.what, n.nominal, CASE WHEN s.what IS NULL THEN g.lower_limit ELSE s.lower_limit END AS lower_limit,
    CASE WHEN s.what IS NULL THEN g.upper_limit ELSE s.upper_limit END AS upper_limit, CASE WHEN s.what IS NOT NULL THEN 'file' WHEN g.what IS NOT NULL THEN 'user' END AS source
FROM named AS n
LEFT JOIN stated AS s ON s.part_id = n.part_id AND s.item = n.item AND s.what = n.what
LEFT JOIN size_tolerance AS g ON g.part_id = n.part_id AND g.item = n.item AND g.what = n.what
    AND g.run_id = (SELECT max(run_id) FROM size_tolerance AS o WHERE o.part_id = g.part_id);

CREATE VIEW characteristic (  -- world: The sizes of a placed object, a numbered list: dimensions of features, and what else has limits; each part has its own.
    world, object, object_no, number,  -- the placed object, its name in the world, and ordinal in it, from 1, by path and what
    path, occurrence_id, item, what, nominal, lower_limit, upper_limit, source  -- path with item, the placed part, and as in bounded_size
) AS
SELECT p.world, p.name AS object, p.object_no,
    row_number() OVER (PARTITION BY p.object_no ORDER BY n.path COLLATE "C", s.item COLLATE "C", s.what COLLATE "C") AS number,
    concat(p.name, n.path, CASE WHEN s.item <> '' THEN '/' END, s.item) AS path,
    CAST(p.object_no AS BIGINT) * 268435456 + n.node_no AS occurrence_id, s.item, s.what, s.nominal, s.lower_limit, s.upper_limit, s.source
FROM placed_object AS p
JOIN object_node AS n ON n.object_id = p.object_id
JOIN bounded_size AS s ON s.part_id = n.part_id
WHERE s.source IS NOT NULL OR s.what NOT IN ('shift', 'presence', 'offset');

CREATE VIEW characteristic_result (  -- localisation: What each inspection says of the characteristics of the inspected objects, by ISO 14253-1.
    run_id, object_no, number, path, what, nominal, lower_limit, upper_limit, source,  -- the inspection, and as in characteristic
    state,  -- state of the part, feature or face, as in presence; null where it was not in view, or the pose is not accepted
    measured, deviation,  -- the measured value, mm, or how many are there, and that less the nominal; null where it was not seen
    expanded_uncertainty,  -- U: two of its standard deviations (k = 2), mm; of counts how many are not decided
    decision, reason  -- conforms, does not conform, not decidable or not seen, null where it was seen and has no limits; and why, where unclear
) AS
WITH counted AS (  -- holes of a pattern that are decided
    SELECT p.run_id, p.occurrence_id, f.name AS item, count(DISTINCT CASE WHEN p.state = 'contradicted' THEN p.item_no END) AS gone,
        count(DISTINCT CASE WHEN p.state IN ('confirmed', 'changed') THEN p.item_no END) AS there
    FROM presence AS p
    JOIN placed_object AS o ON o.object_no = p.occurrence_id >> 28
    JOIN object_node AS s ON s.object_id = o.object_id AND s.node_no = p.occurrence_id & 268435455
    JOIN feature_surface AS a ON a.shape_id = s.shape_id AND a.feature_no = p.feature_no AND a.role = 'wall'
    JOIN feature_surface AS b ON b.shape_id = a.shape_id AND b.surface_no = a.surface_no AND b.role = 'hole'
    JOIN feature AS f ON f.shape_id = b.shape_id AND f.feature_no = b.feature_no
    GROUP BY p.run_id, p.occurrence_id, f.name
),
taken AS (  -- of several faces of one size the best measured counts, of walls of a pocket that are as far apart the pair most off
    SELECT i.run_id, l.*, p.state, CASE WHEN l.what IN ('presence', 'count') THEN 0.5 ELSE 0 END AS slack,
        CASE WHEN l.what = 'count' THEN CASE WHEN c.there + c.gone > 0 THEN c.there END WHEN l.what <> 'presence' THEN m.value
            WHEN p.state IN ('confirmed', 'changed') THEN 1 WHEN p.state IN ('contradicted', 'not_confirmed') THEN 0 END AS measured,
        CASE WHEN l.what = 'count' THEN l.nominal - c.gone - c.there WHEN l.what <> 'presence' THEN 2 * m.sigma
            WHEN p.state = 'not_confirmed' THEN 1 ELSE 0 END AS beyond,
        row_number() OVER (PARTITION BY i.run_id, l.object_no, l.number
            ORDER BY CASE m.what WHEN 'width' THEN -abs(m.value - m.nominal) ELSE m.sigma END, m.measure_no) AS place
    FROM inspection AS i
    JOIN world AS w ON w.id = i.world_id
    JOIN placed_body AS b ON b.role = 'inspected' AND b.body_no = 0 AND w.revision BETWEEN b.first_revision AND coalesce(b.last_revision, w.revision)
    JOIN characteristic AS l ON l.object_no = b.object_no AND l.world = w.name
    LEFT JOIN presence AS p ON p.run_id = i.run_id AND p.occurrence_id = l.occurrence_id AND p.path = l.path AND i.verdict = 'accepted'
    LEFT JOIN measured_size AS m ON m.run_id = p.run_id AND m.item_no = p.item_no AND p.state NOT IN ('undecidable', 'contradicted')
        AND m.what = CASE WHEN l.what = 'length' THEN 'width' WHEN right(l.what, 8) = 'diameter' THEN 'diameter' ELSE l.what END AND abs(m.nominal - l.nominal) < 0.01
    LEFT JOIN counted AS c ON c.run_id = i.run_id AND c.occurrence_id = l.occurrence_id AND c.item = l.item AND i.verdict = 'accepted'
),
judged AS (  -- whole numbers may lie on a limit, and be greater only by what is not decided
    SELECT *, CASE WHEN coalesce(lower_limit, upper_limit) IS NULL AND measured IS NOT NULL THEN NULL
            WHEN state = 'contradicted' AND slack = 0 AND coalesce(lower_limit, upper_limit) IS NOT NULL THEN 'does not conform' WHEN measured IS NULL THEN 'not seen'
            WHEN measured + beyond < lower_limit OR measured - CASE slack WHEN 0 THEN beyond ELSE 0 END > upper_limit THEN 'does not conform'
            WHEN coalesce(measured - CASE slack WHEN 0 THEN beyond ELSE 0 END + slack > lower_limit, TRUE)
                AND coalesce(measured + beyond - slack < upper_limit, TRUE) THEN 'conforms'
            ELSE 'not decidable' END AS decision
    FROM taken WHERE place = 1
)
SELECT run_id, object_no, number, path, what, nominal, lower_limit, upper_limit, source, state, measured,
    measured - nominal AS deviation, CASE WHEN measured IS NOT NULL THEN beyond END AS expanded_uncertainty, decision,
    CASE WHEN decision = 'does not conform' AND measured IS NULL THEN 'something else is there'
        WHEN decision IS DISTINCT FROM 'not decidable' THEN NULL WHEN slack > 0 THEN 'not all of it is decided'
        WHEN upper_limit - lower_limit <= 2 * beyond THEN 'U is too great for the tolerance' ELSE 'the value is within U of a limit' END AS reason
FROM judged;
