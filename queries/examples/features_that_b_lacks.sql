-- Which features of variant A does variant B lack?  (After relmodel diff A B --object bulkhead.)
SELECT kind, name_a AS feature, x, y, z
FROM variant_change
WHERE object_a = 'bulkhead' AND variant_a = 'A' AND object_b = 'bulkhead' AND variant_b = 'B'
    AND level = 'feature' AND status = 'removed'
ORDER BY x, y, kind
