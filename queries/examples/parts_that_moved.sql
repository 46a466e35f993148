-- Which placed parts of bulkhead moved between variants A and B, and how far?  (After relmodel diff A B --object bulkhead.)
SELECT object_path_b AS path, dx, dy, dz, distance, degrees(angle) AS turned_deg
FROM variant_change
WHERE object_a = 'bulkhead' /* object */ AND variant_a = 'A' /* before */ AND variant_b = 'B' /* after */ AND level = 'part' AND status = 'moved'
ORDER BY object_path_b
