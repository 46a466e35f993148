-- Which pockets of bulkhead are deeper than 40 mm?
SELECT feature AS pocket, value AS depth, x, y
FROM placed_part_feature
WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
    AND kind = 'pocket' AND dimension = 'depth' AND value > 40 /* depth */
ORDER BY value DESC, feature_no
