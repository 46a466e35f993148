-- Which pockets of bulkhead have corners of less than 12 mm radius?
SELECT feature AS pocket, value AS corner_radius, x, y
FROM placed_part_feature
WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
    AND kind = 'pocket' AND dimension = 'corner_radius' AND value < 12 /* radius */ - 1e-6
ORDER BY value, feature_no
