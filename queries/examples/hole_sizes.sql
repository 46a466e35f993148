-- How many holes of each diameter has bulkhead?
SELECT round(CAST(value AS NUMERIC), 3) AS diameter, count(*) AS holes
FROM placed_part_feature
WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
    AND kind IN ('through_hole', 'blind_hole') AND dimension = 'diameter'
GROUP BY round(CAST(value AS NUMERIC), 3)
ORDER BY diameter
