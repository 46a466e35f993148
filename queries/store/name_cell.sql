-- Makes a store that of a cell, and with it another store than it was under another name.
-- Takes store_id, a new one, and cell; gives nothing.
UPDATE store
SET id = :store_id, cell = :cell
WHERE cell <> :cell
