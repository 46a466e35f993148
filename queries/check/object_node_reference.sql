-- Nodes of expanded objects that point at an object, part, shape, container or body which is not there, and loaded
-- objects that are not expanded.
-- Takes nothing; gives object_id, path and what is missing.
SELECT n.object_id, n.path,
    CASE WHEN n.child_id IS NOT NULL AND b.id IS NULL THEN 'object' WHEN n.part_id IS NOT NULL AND p.id IS NULL THEN 'part'
        WHEN n.part_id IS NOT NULL AND s.id IS NULL THEN 'shape' WHEN body.node_no IS NULL THEN 'body' ELSE 'container'
        END AS missing
FROM object_node AS n
LEFT JOIN object AS b ON b.id = n.child_id
LEFT JOIN part AS p ON p.id = n.part_id
LEFT JOIN shape AS s ON s.id = n.shape_id AND s.id = p.shape_id
LEFT JOIN object_node AS above ON above.object_id = n.object_id AND above.node_no = n.parent_no AND above.part_id IS NULL
LEFT JOIN object_node AS body ON body.object_id = n.object_id AND body.node_no = n.body_no AND body.part_id IS NULL
WHERE n.child_id IS NOT NULL AND b.id IS NULL OR n.part_id IS NOT NULL AND (p.id IS NULL OR s.id IS NULL)
    OR above.node_no IS NULL AND n.node_no <> 0 OR body.node_no IS NULL
UNION ALL
SELECT v.object_id, '', 'expansion'
FROM object_variant AS v
WHERE NOT EXISTS (SELECT 1 FROM object_node AS n WHERE n.object_id = v.object_id)
ORDER BY 1, 2, 3
