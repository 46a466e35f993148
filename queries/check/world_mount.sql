-- Mounts whose carrier is not placed, and mounted objects that do not stand where their mount places them.
-- Takes nothing; gives world_id and name.
SELECT v.id AS world_id, m.name
FROM world AS v
JOIN world_mount AS m ON m.world = v.name
    AND v.revision BETWEEN m.first_revision AND coalesce(m.last_revision, v.revision)
LEFT JOIN placed_mount AS p ON p.world_id = v.id AND p.mount_no = m.mount_no
LEFT JOIN world_object AS w ON w.world_id = v.id AND w.object_no = m.mounted_no
WHERE p.mount_no IS NULL
    OR abs(w.m00 - p.m00) + abs(w.m01 - p.m01) + abs(w.m02 - p.m02) + abs(w.m10 - p.m10) + abs(w.m11 - p.m11)
        + abs(w.m12 - p.m12) + abs(w.m20 - p.m20) + abs(w.m21 - p.m21) + abs(w.m22 - p.m22) > 1e-9
    OR abs(w.m03 - p.m03) + abs(w.m13 - p.m13) + abs(w.m23 - p.m23) > 1e-6
ORDER BY v.id, m.mount_no
