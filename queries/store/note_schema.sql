-- Notes which schema a new store was made with.
-- Takes sha256, that of the SQL files; gives nothing.
INSERT INTO store_schema (sha256) VALUES (:sha256)
