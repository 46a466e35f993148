-- The latest revision loaded under the name of an object and a variant.
-- Takes name and variant; gives no row or one.
SELECT id, revision, object_id FROM object_variant
WHERE name = :name AND variant = :variant
ORDER BY revision DESC
LIMIT 1
