-- What questions are about: an object, by default that of the newest inspection, its part of most features, and what goes with it.
-- Takes object (empty: any) and variant (where it has that); gives a row, or none where there is no such object: the columns are parameters of questions.
SELECT p.object, p.variant, p.object_path AS part, p.number, '%' || lower(p.material) || '%' AS material,
    (SELECT min(v.variant) FROM object_variant AS v WHERE v.name = p.object) AS before,
    (SELECT nullif(max(v.variant), min(v.variant)) FROM object_variant AS v WHERE v.name = p.object) AS after,
    (SELECT min(w.world) FROM world_part AS w WHERE w.object = p.object) AS world,
    (SELECT min(n.camera) FROM inspection_image AS n WHERE n.run_id = (SELECT max(run_id) FROM inspection_image)) AS camera
FROM placed_part AS p
WHERE CAST(:object AS TEXT) IN ('', p.object)
ORDER BY coalesce(p.variant = nullif(CAST(:variant AS TEXT), ''), FALSE) DESC, (
    SELECT max(i.run_id)
    FROM inspection AS i
    JOIN world_object AS o ON o.world_id = i.world_id AND o.role = 'inspected'
    JOIN object_variant AS v ON v.id = o.object_variant_id
    WHERE v.name = p.object AND v.variant = p.variant
) DESC NULLS LAST, (SELECT count(*) FROM feature AS f WHERE f.shape_id = p.shape_id) DESC, p.object_path
LIMIT 1
