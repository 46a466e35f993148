-- Nodes of expanded objects whose transform is not that of their container times that of their instance; bodies whose
-- transform is not the identity.
-- Takes nothing; gives object_id and path.
WITH placed AS (
    SELECT
        n.object_id, n.node_no,
        abs(n.m00 - (p.m00 * i.m00 + p.m01 * i.m10 + p.m02 * i.m20))
            + abs(n.m01 - (p.m00 * i.m01 + p.m01 * i.m11 + p.m02 * i.m21))
            + abs(n.m02 - (p.m00 * i.m02 + p.m01 * i.m12 + p.m02 * i.m22))
            + abs(n.m10 - (p.m10 * i.m00 + p.m11 * i.m10 + p.m12 * i.m20))
            + abs(n.m11 - (p.m10 * i.m01 + p.m11 * i.m11 + p.m12 * i.m21))
            + abs(n.m12 - (p.m10 * i.m02 + p.m11 * i.m12 + p.m12 * i.m22))
            + abs(n.m20 - (p.m20 * i.m00 + p.m21 * i.m10 + p.m22 * i.m20))
            + abs(n.m21 - (p.m20 * i.m01 + p.m21 * i.m11 + p.m22 * i.m21))
            + abs(n.m22 - (p.m20 * i.m02 + p.m21 * i.m12 + p.m22 * i.m22)) AS turn,
        abs(n.m03 - (p.m00 * i.m03 + p.m01 * i.m13 + p.m02 * i.m23 + p.m03))
            + abs(n.m13 - (p.m10 * i.m03 + p.m11 * i.m13 + p.m12 * i.m23 + p.m13))
            + abs(n.m23 - (p.m20 * i.m03 + p.m21 * i.m13 + p.m22 * i.m23 + p.m23)) AS shift
    FROM object_node AS n
    JOIN object_node AS p ON p.object_id = n.object_id AND p.node_no = n.parent_no AND p.body_no = n.body_no
    JOIN object_child AS i ON i.parent_id = p.child_id AND (i.part_id = n.part_id OR i.object_id = n.child_id)
    UNION ALL
    SELECT
        n.object_id, n.node_no,
        abs(n.m00 - 1) + abs(n.m01) + abs(n.m02) + abs(n.m10) + abs(n.m11 - 1) + abs(n.m12)
            + abs(n.m20) + abs(n.m21) + abs(n.m22 - 1),
        abs(n.m03) + abs(n.m13) + abs(n.m23)
    FROM object_node AS n
    LEFT JOIN object_node AS p ON p.object_id = n.object_id AND p.node_no = n.parent_no
    WHERE n.node_no = n.body_no AND (n.node_no = 0 OR p.child_id IN (SELECT object_id FROM joint))
)
SELECT n.object_id, n.path
FROM object_node AS n
LEFT JOIN placed AS t ON t.object_id = n.object_id AND t.node_no = n.node_no AND t.turn < 1e-9 AND t.shift < 1e-6
WHERE t.node_no IS NULL
ORDER BY n.object_id, n.path
