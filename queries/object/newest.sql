-- The newest revision of each object and variant that was loaded.
-- Takes run (before which; null: all); gives object_variant_id, object_id, name, variant, revision and the object's
-- content_key, by name and variant.
WITH loaded AS (
    SELECT v.*
    FROM object_variant AS v
    WHERE CAST(:run AS BIGINT) IS NULL
        OR EXISTS (SELECT 1 FROM load_report AS l WHERE l.object_variant_id = v.id AND l.run_id < :run)
)
SELECT v.id AS object_variant_id, v.object_id, v.name, v.variant, v.revision, o.content_key
FROM loaded AS v
JOIN object AS o ON o.id = v.object_id
WHERE NOT EXISTS (
    SELECT 1 FROM loaded AS later
    WHERE later.name = v.name AND later.variant = v.variant AND later.revision > v.revision
)
ORDER BY v.name, v.variant
