-- What does each variant of bulkhead weigh, of how many placed parts, and of how many is the mass not known?
SELECT variant, revision, sum(mass) AS mass_kg, count(*) AS parts, count(*) - count(mass) AS parts_of_unknown_mass
FROM placed_part
WHERE object = 'bulkhead' /* object */
GROUP BY variant, revision
ORDER BY variant
