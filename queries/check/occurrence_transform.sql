-- Placed parts and objects whose transform is not that of what contains them times that of an instance of theirs (of a link: as its joint state places it).
-- Takes nothing; gives occurrence_id and path.
WITH instance AS (
    SELECT object_id AS container, NULL AS object_id, part_id, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_part
    UNION ALL
    SELECT parent_id, child_id, NULL, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
    FROM object_object
),
link AS (
    SELECT l.world_id, CASE WHEN l.robot = '' THEN w.name ELSE w.name || '/' || l.robot END AS robot, l.child_no,
        l.m00, l.m01, l.m02, l.m03,
        l.m10, l.m11, l.m12, l.m13,
        l.m20, l.m21, l.m22, l.m23
    FROM world_link AS l
    JOIN world_object AS w ON w.world_id = l.world_id AND w.object_no = l.object_no
),
placed AS (
    SELECT
        o.id,
        abs(o.m00 - (p.m00 * i.m00 + p.m01 * i.m10 + p.m02 * i.m20)) + abs(o.m01 - (p.m00 * i.m01 + p.m01 * i.m11 + p.m02 * i.m21))
            + abs(o.m02 - (p.m00 * i.m02 + p.m01 * i.m12 + p.m02 * i.m22)) + abs(o.m10 - (p.m10 * i.m00 + p.m11 * i.m10 + p.m12 * i.m20))
            + abs(o.m11 - (p.m10 * i.m01 + p.m11 * i.m11 + p.m12 * i.m21)) + abs(o.m12 - (p.m10 * i.m02 + p.m11 * i.m12 + p.m12 * i.m22))
            + abs(o.m20 - (p.m20 * i.m00 + p.m21 * i.m10 + p.m22 * i.m20)) + abs(o.m21 - (p.m20 * i.m01 + p.m21 * i.m11 + p.m22 * i.m21))
            + abs(o.m22 - (p.m20 * i.m02 + p.m21 * i.m12 + p.m22 * i.m22)) AS turn,
        abs(o.m03 - (p.m00 * i.m03 + p.m01 * i.m13 + p.m02 * i.m23 + p.m03)) + abs(o.m13 - (p.m10 * i.m03 + p.m11 * i.m13 + p.m12 * i.m23 + p.m13))
            + abs(o.m23 - (p.m20 * i.m03 + p.m21 * i.m13 + p.m22 * i.m23 + p.m23)) AS shift
    FROM occurrence AS o
    JOIN occurrence AS p ON p.id = o.parent_id
    JOIN instance AS i ON i.container = p.object_id AND (i.part_id = o.part_id OR i.object_id = o.object_id)
    WHERE NOT EXISTS (SELECT 1 FROM link AS l WHERE l.world_id = p.world_id AND l.robot = p.path)
    UNION ALL
    SELECT
        o.id,
        abs(o.m00 - (p.m00 * l.m00 + p.m01 * l.m10 + p.m02 * l.m20)) + abs(o.m01 - (p.m00 * l.m01 + p.m01 * l.m11 + p.m02 * l.m21))
            + abs(o.m02 - (p.m00 * l.m02 + p.m01 * l.m12 + p.m02 * l.m22)) + abs(o.m10 - (p.m10 * l.m00 + p.m11 * l.m10 + p.m12 * l.m20))
            + abs(o.m11 - (p.m10 * l.m01 + p.m11 * l.m11 + p.m12 * l.m21)) + abs(o.m12 - (p.m10 * l.m02 + p.m11 * l.m12 + p.m12 * l.m22))
            + abs(o.m20 - (p.m20 * l.m00 + p.m21 * l.m10 + p.m22 * l.m20)) + abs(o.m21 - (p.m20 * l.m01 + p.m21 * l.m11 + p.m22 * l.m21))
            + abs(o.m22 - (p.m20 * l.m02 + p.m21 * l.m12 + p.m22 * l.m22)),
        abs(o.m03 - (p.m00 * l.m03 + p.m01 * l.m13 + p.m02 * l.m23 + p.m03)) + abs(o.m13 - (p.m10 * l.m03 + p.m11 * l.m13 + p.m12 * l.m23 + p.m13))
            + abs(o.m23 - (p.m20 * l.m03 + p.m21 * l.m13 + p.m22 * l.m23 + p.m23))
    FROM occurrence AS o
    JOIN occurrence AS p ON p.id = o.parent_id
    JOIN link AS l ON l.world_id = p.world_id AND l.robot = p.path
    JOIN object_object AS i ON i.parent_id = p.object_id AND i.child_no = l.child_no AND i.child_id = o.object_id
    UNION ALL
    SELECT
        o.id,
        abs(o.m00 - w.m00) + abs(o.m01 - w.m01) + abs(o.m02 - w.m02) + abs(o.m10 - w.m10) + abs(o.m11 - w.m11)
            + abs(o.m12 - w.m12) + abs(o.m20 - w.m20) + abs(o.m21 - w.m21) + abs(o.m22 - w.m22),
        abs(o.m03 - w.m03) + abs(o.m13 - w.m13) + abs(o.m23 - w.m23)
    FROM occurrence AS o
    JOIN world_object AS w ON w.world_id = o.world_id AND w.object_no = o.object_no
    WHERE o.parent_id IS NULL
)
SELECT o.id AS occurrence_id, o.path
FROM occurrence AS o
LEFT JOIN placed AS t ON t.id = o.id AND t.turn < 1e-9 AND t.shift < 1e-6
WHERE t.id IS NULL
ORDER BY o.id
