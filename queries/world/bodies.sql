-- The bodies of expanded objects: each object itself, and the links of the robots in it.
-- Takes object_ids (array); gives object_id, body_no, path (of a link, a / before each name; empty of the object), and
-- the box x0 .. z1 around the parts of each in its frame (null where it has none), sorted by the first two.
SELECT n.object_id, n.body_no, n.path, p.x0, p.y0, p.z0, p.x1, p.y1, p.z1
FROM object_node AS n
LEFT JOIN (
    SELECT object_id, body_no,
        min(x0) AS x0, min(y0) AS y0, min(z0) AS z0, max(x1) AS x1, max(y1) AS y1, max(z1) AS z1
    FROM object_page
    GROUP BY object_id, body_no
) AS p ON p.object_id = n.object_id AND p.body_no = n.body_no
WHERE n.object_id = ANY(CAST(:object_ids AS BIGINT[])) AND n.node_no = n.body_no
ORDER BY n.object_id, n.body_no
