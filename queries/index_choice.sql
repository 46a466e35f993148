-- Kind of index that was found best for a world.
-- takes: world_id
-- gives: kind; no row where none was compared
SELECT value_text AS kind
FROM world_attribute
WHERE world_id = :world_id AND name = 'index_kind'
