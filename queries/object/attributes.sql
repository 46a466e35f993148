-- Attributes of objects and of parts; of parts also how many dimensions, tolerances and datums they have.
-- Takes object_ids and part_ids (arrays).  Gives level, id, name, value as text, unit, sorted.
SELECT 'object' AS level, object_id AS id, name, coalesce(value_text, CAST(value_number AS TEXT)) AS value, unit
FROM object_attribute
WHERE object_id = ANY(:object_ids)
UNION ALL
SELECT 'part', part_id, name, coalesce(value_text, CAST(value_number AS TEXT)), unit
FROM part_attribute
WHERE part_id = ANY(:part_ids)
UNION ALL
SELECT 'part', part_id, kind || 's', CAST(count(*) AS TEXT), CAST(NULL AS TEXT)
FROM part_pmi
WHERE part_id = ANY(:part_ids)
GROUP BY part_id, kind
ORDER BY 1, 2, 3
