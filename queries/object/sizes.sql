-- Sizes of parts, features and faces by path: the object's name, then as relmodel show has it.
-- Takes paths (array), variant (empty: all); gives one row a size: variant, path, and the rest as bounded_size has it.
SELECT v.variant, concat(v.name, n.path, CASE WHEN s.item <> '' THEN '/' END, s.item) AS path, s.part_id, s.item, s.what, s.nominal, s.source
FROM object_variant AS v
JOIN object_node AS n ON n.object_id = v.object_id
JOIN bounded_size AS s ON s.part_id = n.part_id
WHERE concat(v.name, n.path, CASE WHEN s.item <> '' THEN '/' END, s.item) = ANY(:paths) AND (v.variant = :variant OR :variant = '')
    AND NOT EXISTS (SELECT 1 FROM object_variant AS o WHERE o.name = v.name AND o.variant = v.variant AND o.revision > v.revision)
