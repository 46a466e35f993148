-- Which ribs of bulkhead are thinner than 6.2 mm, and where?
SELECT feature AS rib, value AS thickness, x, y
FROM placed_part_feature
WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
    AND kind = 'rib' AND dimension = 'thickness' AND value < 6.2 /* thickness */
ORDER BY value, feature_no
