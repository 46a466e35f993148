-- Objects and variants that were loaded, each in its newest revision.
-- Takes nothing; gives name, variant, revision, parts (how many stand in it), mass_kg (null where that of some is not known),
-- file (that it was first loaded from), format and object_id.
SELECT v.name, v.variant, v.revision, p.parts, p.mass_kg, s.file_name AS file, s.format, v.object_id
FROM object_variant AS v
JOIN source AS s ON s.id = v.source_id
LEFT JOIN (
    SELECT object, variant, count(*) AS parts, CASE WHEN count(mass) = count(*) THEN sum(mass) END AS mass_kg
    FROM placed_part
    GROUP BY object, variant
) AS p ON p.object = v.name AND p.variant = v.variant
WHERE NOT EXISTS (
    SELECT 1 FROM object_variant AS later
    WHERE later.name = v.name AND later.variant = v.variant AND later.revision > v.revision
)
ORDER BY v.name, v.variant
