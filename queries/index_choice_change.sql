-- Another kind of index, or size of the grid's cells, is found best for a world than was before.
-- Takes world_id, kind and grid_cell_mm.
-- Gives nothing.
UPDATE world_attribute
SET value_text = CASE name WHEN 'index_kind' THEN CAST(:kind AS TEXT) END,
    value_number = CASE name WHEN 'grid_cell_mm' THEN CAST(:grid_cell_mm AS DOUBLE PRECISION) END
WHERE world_id = :world_id AND name IN ('index_kind', 'grid_cell_mm')
