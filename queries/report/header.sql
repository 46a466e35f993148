-- What the head of a report that is signed says: part, serial number, cell, rig, operator and date.
-- Takes run_id; gives a row of an inspection, however it ended; part: the inspected objects of its world with their
-- variants, null where it came to no answer or was pruned; rig: its file.
SELECT string_agg(CASE WHEN v.id IS NOT NULL THEN concat(v.name, CASE v.variant WHEN '' THEN '' ELSE concat(' variant ', v.variant) END,
        ' revision ', v.revision) END, ', ' ORDER BY o.object_no) AS part,
    coalesce(i.serial, (r.parameters ->> 'serial')) AS serial, nullif(s.cell, '') AS cell,
    coalesce(w.name, nullif((r.parameters ->> 'world'), '')) AS world,
    (SELECT min(n.name) FROM run_input AS n WHERE n.run_id = r.id AND n.role = 'rig') AS rig,
    r.parameters ->> 'operator' AS operator, r.began_at AS date, r.id AS run
FROM run AS r
CROSS JOIN store AS s
LEFT JOIN inspection AS i ON i.run_id = r.id
LEFT JOIN world AS w ON w.id = i.world_id
LEFT JOIN world_object AS o ON o.world_id = i.world_id AND o.role = 'inspected'
LEFT JOIN object_variant AS v ON v.id = o.object_variant_id
WHERE r.id = :run_id AND r.kind = 'inspect'
GROUP BY i.serial, w.name, s.cell, r.began_at, r.id, r.parameters ->> 'serial', r.parameters ->> 'world', r.parameters ->> 'operator'
