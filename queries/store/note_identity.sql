-- Gives a new store its identity.
-- Takes store_id and cell; gives nothing.
INSERT INTO store_identity (id, cell) VALUES (:store_id, :cell)
