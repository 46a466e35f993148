-- Takes :name, :variant.  Gives the latest revision loaded under that name and variant, if there is one.
SELECT id, revision, object_id FROM object_variant
WHERE name = :name AND variant = :variant
ORDER BY revision DESC
LIMIT 1
