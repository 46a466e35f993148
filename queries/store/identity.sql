-- Which store this is.
-- Takes nothing; gives store_id and cell, one row.
SELECT id AS store_id, cell
FROM store
