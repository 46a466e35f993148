-- Mounts of a world that hold no longer end with the revision before.
-- Takes world (its name), mount_nos (array) and revision; gives nothing.
UPDATE world_mount
SET last_revision = :revision - 1
WHERE world = :world AND last_revision IS NULL AND mount_no = ANY(CAST(:mount_nos AS INTEGER[]))
