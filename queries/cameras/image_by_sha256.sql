-- Identity of an image by its content.
-- Takes sha256; gives no row or one.
SELECT id FROM image WHERE sha256 = :sha256
