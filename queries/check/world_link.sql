-- Links of the robots of a world that do not stand where the state of the joints places them.
-- Takes nothing; gives world_id, robot (its path in the world) and child_no of the link.
-- A joint turns about its axis (Rodrigues) or moves along it; one that follows another is worked out from that.
WITH RECURSIVE robot AS (
    SELECT o.world_id, w.name AS world, w.revision, o.object_no, o.object_id, o.path,
        CASE WHEN o.parent_id IS NULL THEN '' ELSE substr(o.path, strpos(o.path, '/') + 1) END AS robot,
        o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23
    FROM occurrence AS o
    JOIN world AS w ON w.id = o.world_id
    WHERE o.object_id IN (SELECT object_id FROM joint)
),
stand AS (
    SELECT r.world_id, r.object_no, r.robot, j.parent_link, j.child_link, j.kind,
        coalesce(CASE WHEN j.mimic_joint IS NULL THEN s.value ELSE j.mimic_factor * s.value + j.mimic_offset END, 0) AS q,
        j.axis_x AS x, j.axis_y AS y, j.axis_z AS z,
        j.m00 AS p00, j.m01 AS p01, j.m02 AS p02, j.m03 AS p03,
        j.m10 AS p10, j.m11 AS p11, j.m12 AS p12, j.m13 AS p13,
        j.m20 AS p20, j.m21 AS p21, j.m22 AS p22, j.m23 AS p23
    FROM robot AS r
    JOIN joint AS j ON j.object_id = r.object_id
    LEFT JOIN joint_state AS s
        ON s.object_no = r.object_no AND s.robot = r.robot AND s.joint = coalesce(j.mimic_joint, j.name)
        AND r.revision BETWEEN s.first_revision AND coalesce(s.last_revision, r.revision)
),
motion AS (
    SELECT s.*,
        a.c + s.x * s.x * (1 - a.c) AS t00, s.x * s.y * (1 - a.c) - s.z * a.s AS t01,
        s.x * s.z * (1 - a.c) + s.y * a.s AS t02, a.along * s.x AS t03,
        s.y * s.x * (1 - a.c) + s.z * a.s AS t10, a.c + s.y * s.y * (1 - a.c) AS t11,
        s.y * s.z * (1 - a.c) - s.x * a.s AS t12, a.along * s.y AS t13,
        s.z * s.x * (1 - a.c) - s.y * a.s AS t20, s.z * s.y * (1 - a.c) + s.x * a.s AS t21,
        a.c + s.z * s.z * (1 - a.c) AS t22, a.along * s.z AS t23
    FROM stand AS s
    CROSS JOIN LATERAL (
        SELECT CASE WHEN s.kind IN ('revolute', 'continuous') THEN cos(s.q) ELSE 1 END AS c,
            CASE WHEN s.kind IN ('revolute', 'continuous') THEN sin(s.q) ELSE 0 END AS s,
            CASE WHEN s.kind = 'prismatic' THEN s.q ELSE 0 END AS along
    ) AS a
),
step AS (
    SELECT m.world_id, m.object_no, m.robot, m.parent_link, m.child_link,
        m.p00 * m.t00 + m.p01 * m.t10 + m.p02 * m.t20 AS m00,
        m.p00 * m.t01 + m.p01 * m.t11 + m.p02 * m.t21 AS m01,
        m.p00 * m.t02 + m.p01 * m.t12 + m.p02 * m.t22 AS m02,
        m.p00 * m.t03 + m.p01 * m.t13 + m.p02 * m.t23 + m.p03 AS m03,
        m.p10 * m.t00 + m.p11 * m.t10 + m.p12 * m.t20 AS m10,
        m.p10 * m.t01 + m.p11 * m.t11 + m.p12 * m.t21 AS m11,
        m.p10 * m.t02 + m.p11 * m.t12 + m.p12 * m.t22 AS m12,
        m.p10 * m.t03 + m.p11 * m.t13 + m.p12 * m.t23 + m.p13 AS m13,
        m.p20 * m.t00 + m.p21 * m.t10 + m.p22 * m.t20 AS m20,
        m.p20 * m.t01 + m.p21 * m.t11 + m.p22 * m.t21 AS m21,
        m.p20 * m.t02 + m.p21 * m.t12 + m.p22 * m.t22 AS m22,
        m.p20 * m.t03 + m.p21 * m.t13 + m.p22 * m.t23 + m.p23 AS m23
    FROM motion AS m
),
placed AS (
    SELECT r.world_id, r.object_no, r.robot, i.name AS link,
        r.m00, r.m01, r.m02, r.m03, r.m10, r.m11, r.m12, r.m13, r.m20, r.m21, r.m22, r.m23
    FROM robot AS r
    JOIN object_object AS i ON i.parent_id = r.object_id
    WHERE NOT EXISTS (SELECT 1 FROM joint AS j WHERE j.object_id = r.object_id AND j.child_link = i.name)
    UNION ALL
    SELECT p.world_id, p.object_no, p.robot, s.child_link,
        p.m00 * s.m00 + p.m01 * s.m10 + p.m02 * s.m20,
        p.m00 * s.m01 + p.m01 * s.m11 + p.m02 * s.m21,
        p.m00 * s.m02 + p.m01 * s.m12 + p.m02 * s.m22,
        p.m00 * s.m03 + p.m01 * s.m13 + p.m02 * s.m23 + p.m03,
        p.m10 * s.m00 + p.m11 * s.m10 + p.m12 * s.m20,
        p.m10 * s.m01 + p.m11 * s.m11 + p.m12 * s.m21,
        p.m10 * s.m02 + p.m11 * s.m12 + p.m12 * s.m22,
        p.m10 * s.m03 + p.m11 * s.m13 + p.m12 * s.m23 + p.m13,
        p.m20 * s.m00 + p.m21 * s.m10 + p.m22 * s.m20,
        p.m20 * s.m01 + p.m21 * s.m11 + p.m22 * s.m21,
        p.m20 * s.m02 + p.m21 * s.m12 + p.m22 * s.m22,
        p.m20 * s.m03 + p.m21 * s.m13 + p.m22 * s.m23 + p.m23
    FROM placed AS p
    JOIN step AS s
        ON s.world_id = p.world_id AND s.object_no = p.object_no AND s.robot = p.robot AND s.parent_link = p.link
)
SELECT r.world_id, r.path AS robot, i.child_no
FROM robot AS r
JOIN object_object AS i ON i.parent_id = r.object_id
JOIN object_child AS c ON c.parent_id = i.parent_id AND c.child_no = i.child_no AND c.object_id IS NOT NULL
LEFT JOIN occurrence AS l ON l.world_id = r.world_id AND l.path = r.path || '/' || c.segment
LEFT JOIN placed AS p
    ON p.world_id = r.world_id AND p.object_no = r.object_no AND p.robot = r.robot AND p.link = i.name
WHERE p.link IS NULL OR l.id IS NULL
    OR abs(l.m00 - p.m00) + abs(l.m01 - p.m01) + abs(l.m02 - p.m02)
        + abs(l.m10 - p.m10) + abs(l.m11 - p.m11) + abs(l.m12 - p.m12)
        + abs(l.m20 - p.m20) + abs(l.m21 - p.m21) + abs(l.m22 - p.m22) > 1e-9
    OR abs(l.m03 - p.m03) + abs(l.m13 - p.m13) + abs(l.m23 - p.m23) > 1e-6
ORDER BY 1, 2, 3
