-- Identity of a rig by its content.
-- Takes content_key; gives no row or one.
SELECT id FROM rig WHERE content_key = :content_key
