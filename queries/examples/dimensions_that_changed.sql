-- Which holes of bulkhead, variant A, have other dimensions in B, and what were they?  (After relmodel diff A B --object bulkhead.)
SELECT kind, name_a AS feature, differs, x, y
FROM variant_change
WHERE object_a = 'bulkhead' /* object */ AND variant_a = 'A' /* before */ AND object_b = 'bulkhead' /* object */ AND variant_b = 'B' /* after */
    AND level = 'feature' AND status = 'changed' AND kind IN ('through_hole', 'blind_hole')
ORDER BY x, y
