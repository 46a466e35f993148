-- What the head of a report that is signed says: part, serial number, cell, rig, operator and date.
-- Takes run_id; gives no row or one; part: the inspected objects of its world with their variants; rig: its file.
SELECT string_agg(concat(v.name, CASE v.variant WHEN '' THEN '' ELSE concat(' variant ', v.variant) END,
        ' revision ', v.revision), ', ' ORDER BY o.object_no) AS part,
    i.serial, nullif(s.cell, '') AS cell, w.name AS world,
    (SELECT min(n.name) FROM run_input AS n WHERE n.run_id = r.id AND n.role = 'rig') AS rig,
    r.parameters ->> 'operator' AS operator, r.began_at AS date, r.id AS run
FROM inspection AS i
JOIN run AS r ON r.id = i.run_id
JOIN world AS w ON w.id = i.world_id
CROSS JOIN store AS s
LEFT JOIN world_object AS o ON o.world_id = i.world_id AND o.role = 'inspected'
LEFT JOIN object_variant AS v ON v.id = o.object_variant_id
WHERE i.run_id = :run_id
GROUP BY i.serial, w.name, s.cell, r.began_at, r.id, r.parameters ->> 'operator'
