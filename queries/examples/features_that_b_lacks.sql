-- Which features of bulkhead, variant A, does B lack?  (After relmodel diff A B --object bulkhead.)
SELECT kind, name_a AS feature, x, y, z
FROM variant_change
WHERE object_a = 'bulkhead' /* object */ AND variant_a = 'A' /* before */ AND object_b = 'bulkhead' /* object */ AND variant_b = 'B' /* after */
    AND level = 'feature' AND status = 'removed'
ORDER BY x, y, kind
