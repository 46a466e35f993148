-- Identity of a camera by its content.
-- Takes content_key; gives no row or one.
SELECT id FROM camera WHERE content_key = :content_key
