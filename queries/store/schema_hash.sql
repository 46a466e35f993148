-- Which store this is, and the SHA-256 of the schema that it was made with.
-- Takes nothing; gives store_id and sha256.
SELECT id AS store_id, schema_sha256 AS sha256 FROM store
