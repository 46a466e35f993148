-- What does each variant weigh, of how many placed parts, and of how many is the mass not known?
SELECT v.variant, v.revision, sum(p.mass) AS mass_kg, sum(p.placed) AS parts,
    sum(CASE WHEN p.mass IS NULL THEN p.placed ELSE 0 END) AS parts_of_unknown_mass
FROM object_variant AS v
JOIN placed_part AS p ON p.object_id = v.object_id
WHERE v.name = 'bulkhead' /* object */
GROUP BY v.variant, v.revision
ORDER BY v.variant, v.revision
