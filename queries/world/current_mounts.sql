-- What is mounted in the newest revision of a world.
-- Takes world (its name); gives mount_no, name, object_no, link, object_path, rig_id, mounted_no and
-- carrier_from_mounted as m00 .. m23.
SELECT mount_no, name, object_no, link, object_path, rig_id, mounted_no,
    m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23
FROM world_mount
WHERE world = :world AND last_revision IS NULL
