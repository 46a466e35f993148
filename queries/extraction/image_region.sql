-- The regions of an extraction.
-- Takes extraction_id; gives area, centroid_x, centroid_y, x0, y0, x1, y1, mean, variance, slope_x, slope_y,
-- saturated_share, hole_count.
SELECT CAST(area AS DOUBLE PRECISION) AS area,
    CAST(centroid_x AS DOUBLE PRECISION) AS centroid_x,
    CAST(centroid_y AS DOUBLE PRECISION) AS centroid_y,
    CAST(x0 AS DOUBLE PRECISION) AS x0,
    CAST(y0 AS DOUBLE PRECISION) AS y0,
    CAST(x1 AS DOUBLE PRECISION) AS x1,
    CAST(y1 AS DOUBLE PRECISION) AS y1,
    CAST(mean AS DOUBLE PRECISION) AS mean,
    CAST(variance AS DOUBLE PRECISION) AS variance,
    CAST(slope_x AS DOUBLE PRECISION) AS slope_x,
    CAST(slope_y AS DOUBLE PRECISION) AS slope_y,
    CAST(saturated_share AS DOUBLE PRECISION) AS saturated_share,
    hole_count
FROM image_region
WHERE extraction_id = :extraction_id
ORDER BY region_no
