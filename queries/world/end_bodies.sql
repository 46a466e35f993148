-- Bodies of placed objects that hold no longer end with the revision before.
-- Takes object_nos (array) and revision; gives nothing.
UPDATE placed_body
SET last_revision = :revision - 1
WHERE last_revision IS NULL AND object_no = ANY(CAST(:object_nos AS INTEGER[]))
