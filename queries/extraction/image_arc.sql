-- The arcs of an extraction in their order.
-- Takes extraction_id; gives kind, topography, start_x, start_y, end_x, end_y, centre_x, centre_y, radius, radius2,
-- axis_angle, length, closed, contrast, width, sigma, residual, significance, texture, highlight, element_count.
SELECT kind,
    topography,
    CAST(start_x AS DOUBLE PRECISION) AS start_x,
    CAST(start_y AS DOUBLE PRECISION) AS start_y,
    CAST(end_x AS DOUBLE PRECISION) AS end_x,
    CAST(end_y AS DOUBLE PRECISION) AS end_y,
    CAST(centre_x AS DOUBLE PRECISION) AS centre_x,
    CAST(centre_y AS DOUBLE PRECISION) AS centre_y,
    CAST(radius AS DOUBLE PRECISION) AS radius,
    CAST(radius2 AS DOUBLE PRECISION) AS radius2,
    CAST(axis_angle AS DOUBLE PRECISION) AS axis_angle,
    CAST(length AS DOUBLE PRECISION) AS length,
    closed,
    CAST(contrast AS DOUBLE PRECISION) AS contrast,
    CAST(width AS DOUBLE PRECISION) AS width,
    CAST(sigma AS DOUBLE PRECISION) AS sigma,
    CAST(residual AS DOUBLE PRECISION) AS residual,
    CAST(significance AS DOUBLE PRECISION) AS significance,
    CAST(texture AS DOUBLE PRECISION) AS texture,
    CAST(highlight AS DOUBLE PRECISION) AS highlight,
    element_count
FROM image_arc
WHERE extraction_id = :extraction_id
ORDER BY image_arc_no
