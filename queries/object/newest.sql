-- The newest revision of each object and variant that was loaded.
-- Takes nothing; gives object_variant_id, object_id, name, variant, revision and the object's content_key, by name and
-- variant.
SELECT v.id AS object_variant_id, v.object_id, v.name, v.variant, v.revision, o.content_key
FROM object_variant AS v
JOIN object AS o ON o.id = v.object_id
WHERE NOT EXISTS (
    SELECT 1 FROM object_variant AS later
    WHERE later.name = v.name AND later.variant = v.variant AND later.revision > v.revision
)
ORDER BY v.name, v.variant
