-- What differs, without what is identical and called as before.
-- Takes comparison_id; gives level, status, differs, kind, before and after (name of a feature or surface, path of a
-- part), path, dx, dy, dz, distance (mm), angle (rad), the middle x, y, z and element_no (feature_no or surface_no: after, or
-- before where removed); parts, then features, then surfaces.
SELECT d.level, d.status, d.differs, d.kind,
    CASE WHEN d.level = 'part' THEN d.object_path_a ELSE d.name_a END AS before,
    CASE WHEN d.level = 'part' THEN d.object_path_b ELSE d.name_b END AS after,
    coalesce(d.object_path_b, d.object_path_a) AS path, d.dx, d.dy, d.dz, d.distance, d.angle, d.x, d.y, d.z,
    coalesce(d.element_b, d.element_a) AS element_no
FROM variant_change AS d
WHERE d.comparison_id = :comparison_id AND (d.status <> 'identical' OR d.differs IS NOT NULL)
ORDER BY CASE d.level WHEN 'part' THEN 0 WHEN 'feature' THEN 1 ELSE 2 END, d.status, path, d.kind, d.element_a, d.element_b
