-- Which placed parts moved between variants A and B, and how far?  (After relmodel diff.)
SELECT object_path_b AS path, dx, dy, dz, distance, degrees(angle) AS turned_deg
FROM variant_change
WHERE object_a = 'bulkhead' AND variant_a = 'A' AND variant_b = 'B' AND level = 'part' AND status = 'moved'
ORDER BY object_path_b
