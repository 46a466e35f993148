-- Kind of index that was found best for a world, and the cell size that the cost model gives its grid.
-- Takes world_id; gives kind, grid_cell_mm; no row where none was compared.
SELECT k.value_text AS kind, g.value_number AS grid_cell_mm
FROM current_world_attribute AS k
LEFT JOIN current_world_attribute AS g ON g.world_id = k.world_id AND g.name = 'grid_cell_mm'
WHERE k.world_id = :world_id AND k.name = 'index_kind'
