-- What differs, without what is identical.
-- Takes comparison_id.  Gives level, status, kind, name_a, name_b, path, dx, dy, dz, distance (mm), angle (rad) and the
-- middle x, y, z; parts, then features, then surfaces.
SELECT d.level, d.status, d.kind, d.name_a, d.name_b, coalesce(d.path_b, d.path_a) AS path,
    d.dx, d.dy, d.dz, d.distance, d.angle, d.x, d.y, d.z
FROM variant_change AS d
WHERE d.comparison_id = :comparison_id AND d.status <> 'identical'
ORDER BY CASE d.level WHEN 'part' THEN 0 WHEN 'feature' THEN 1 ELSE 2 END, d.status, path, d.kind, d.element_a, d.element_b
