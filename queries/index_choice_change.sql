-- Another kind of index is found best for a world than was before; a revision of a world keeps the cells of its grid.
-- takes: world_id, kind
-- gives: nothing
UPDATE world_attribute
SET value_text = :kind
WHERE world_id = :world_id AND name = 'index_kind'
