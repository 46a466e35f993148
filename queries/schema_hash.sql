-- SHA-256 of the schema that the store was made with: sha256.
SELECT sha256 FROM store_schema
