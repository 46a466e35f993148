-- SHA-256 of the schema that the store was made with.
-- Takes nothing; gives sha256.
SELECT schema_sha256 AS sha256 FROM store
