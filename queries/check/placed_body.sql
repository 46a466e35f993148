-- Placed objects and links that stand twice in a revision of their world, of which only some bodies stand, or whose box
-- does not hold the pages of their parts.
-- Takes nothing; gives object_no, body_no and first_revision.
WITH neighbour AS (
    SELECT b.object_no, b.body_no, b.first_revision,
        count(*) OVER (PARTITION BY b.object_no, b.first_revision) AS bodies,
        max(coalesce(b.last_revision, 2147483647)) OVER (
            PARTITION BY b.object_no, b.body_no ORDER BY b.first_revision
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS before
    FROM placed_body AS b
),
body AS (
    SELECT object_id, count(*) AS bodies
    FROM object_node
    WHERE node_no = body_no
    GROUP BY object_id
)
SELECT s.object_no, s.body_no, s.first_revision
FROM neighbour AS s
LEFT JOIN placed_object AS p ON p.object_no = s.object_no
LEFT JOIN body AS n ON n.object_id = p.object_id
WHERE n.bodies IS NULL OR s.before >= s.first_revision OR s.bodies <> n.bodies
UNION
SELECT b.object_no, b.body_no, b.first_revision
FROM placed_body AS b
JOIN placed_object AS p ON p.object_no = b.object_no
JOIN object_page AS g ON g.object_id = p.object_id AND g.body_no = b.body_no
CROSS JOIN LATERAL (
    SELECT b.m00 * (g.x0 + g.x1) / 2 + b.m01 * (g.y0 + g.y1) / 2 + b.m02 * (g.z0 + g.z1) / 2 + b.m03 AS x,
        b.m10 * (g.x0 + g.x1) / 2 + b.m11 * (g.y0 + g.y1) / 2 + b.m12 * (g.z0 + g.z1) / 2 + b.m13 AS y,
        b.m20 * (g.x0 + g.x1) / 2 + b.m21 * (g.y0 + g.y1) / 2 + b.m22 * (g.z0 + g.z1) / 2 + b.m23 AS z
) AS middle
WHERE b.x0 IS NULL OR NOT (
    middle.x BETWEEN b.x0 AND b.x1 AND middle.y BETWEEN b.y0 AND b.y1 AND middle.z BETWEEN b.z0 AND b.z1
)
ORDER BY 1, 2, 3
