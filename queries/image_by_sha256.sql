-- Identity of an image by its content.
-- Takes sha256.
-- Gives no row or one.
SELECT id FROM image WHERE sha256 = :sha256
