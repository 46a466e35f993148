-- What the head of a report that is signed says: part, serial number, cell, rig with its calibration, pictures, operator and date.
-- Takes run_id; gives a row of an inspection, however it ended; part: the inspected objects of its world with their
-- variants, null where it came to no answer or was pruned; rig: its files, and since when the store has runs with them;
-- calibration: what the pictures say of it; taken_as_given: what the inputs do not say.
SELECT string_agg(CASE WHEN v.id IS NOT NULL THEN concat(v.name, CASE v.variant WHEN '' THEN '' ELSE concat(' variant ', v.variant) END,
        ' revision ', v.revision) END, ', ' ORDER BY o.object_no) AS part,
    coalesce(i.serial, (r.parameters ->> 'serial')) AS serial, r.parameters ->> 'operator' AS operator, r.began_at AS date,
    nullif(s.cell, '') AS cell, coalesce(w.name, nullif((r.parameters ->> 'world'), '')) AS world, r.id AS run,
    (SELECT string_agg(concat(n.name, ', SHA-256 ', left(n.sha256, 12), ', in use since ', (SELECT CAST(min(b.began_at) AS DATE)
            FROM run_input AS a JOIN run AS b ON b.id = a.run_id WHERE a.sha256 = n.sha256)), '; ' ORDER BY n.input_no)
        FROM run_input AS n WHERE n.run_id = r.id AND (n.role = 'rig' OR n.role LIKE 'rig %')) AS rig,
    coalesce((SELECT string_agg(t.sentence, '; ' ORDER BY t.sentence_no) FROM inspection_sentence AS t WHERE t.run_id = r.id AND t.kind = 'rig'),
        (SELECT concat('as the file says; corrected most in ', replace(h.name, '_', ' '), ' of ', h.camera, ': by ', round(CAST(h.difference
                * CASE WHEN h.name = 'focal' THEN 100 WHEN h.name IN ('rx', 'ry', 'rz') THEN degrees(1) ELSE 1 END AS NUMERIC(12, 6)), 3),
                CASE WHEN h.name = 'focal' THEN ' %' WHEN h.name IN ('x', 'y', 'z') THEN ' mm' WHEN h.name IN ('rx', 'ry', 'rz') THEN ' deg'
                WHEN h.name IN ('centre_u', 'centre_v') THEN ' px' END, ', ', round(CAST(abs(h.sigmas) AS NUMERIC(12, 6)), 1), ' sigma')
            FROM camera_history AS h WHERE h.run_id = r.id AND h.name <> 'response' ORDER BY abs(h.sigmas) DESC, h.camera, h.name LIMIT 1)) AS calibration,
    (SELECT concat(count(*), ' of ', max(m.width), ' x ', max(m.height), ' px, blurred by ', coalesce(CAST(round(CAST(max(p.blur_px) AS NUMERIC(9, 3)), 1) AS TEXT), '?'),
            ' px, ', round(CAST(100 * max(p.saturated) AS NUMERIC(9, 3)), 0), ' % too bright')
        FROM inspection_image AS p JOIN image AS m ON m.id = p.image_id WHERE p.run_id = r.id HAVING count(*) > 0) AS pictures,
    (SELECT string_agg(t.sentence, '; ' ORDER BY t.sentence_no) FROM inspection_sentence AS t WHERE t.run_id = r.id AND t.kind = 'note') AS taken_as_given
FROM run AS r
CROSS JOIN store AS s
LEFT JOIN inspection AS i ON i.run_id = r.id
LEFT JOIN world AS w ON w.id = i.world_id
LEFT JOIN world_object AS o ON o.world_id = i.world_id AND o.role = 'inspected'
LEFT JOIN object_variant AS v ON v.id = o.object_variant_id
WHERE r.id = :run_id AND r.kind = 'inspect'
GROUP BY i.serial, w.name, s.cell, r.began_at, r.id, r.parameters ->> 'serial', r.parameters ->> 'world', r.parameters ->> 'operator'
