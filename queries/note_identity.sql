-- Gives a new store its identity.
-- Takes store_id and cell.
INSERT INTO store_identity (id, cell) VALUES (:store_id, :cell)
