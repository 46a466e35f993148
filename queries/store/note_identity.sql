-- Gives a new store its identity, and notes which schema it is made with.
-- Takes store_id, cell and sha256, that of the SQL files; gives nothing.
INSERT INTO store (id, cell, schema_sha256) VALUES (:store_id, :cell, :sha256)
