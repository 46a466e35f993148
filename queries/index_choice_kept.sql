-- What was found of the index of a world holds for its next revision, until it is compared again.
-- Takes world_id and previous (the revision before).
-- Gives nothing.
INSERT INTO world_attribute (world_id, name, value_number, value_text, unit, source)
SELECT :world_id, name, value_number, value_text, unit, source
FROM world_attribute
WHERE world_id = :previous AND name IN ('index_kind', 'grid_cell_mm')
