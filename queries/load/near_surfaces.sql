-- Surfaces whose centroids lie in given cells of a grid.
-- Takes the relation sought (no: of what is looked for; x, y, z: its cell), cell (mm) and shift (of the grid, in
-- cells);
-- gives no, id, what a surface's key is made of and its box, in order of no and id.
SELECT s.no, f.id, f.kind, f.recognised_kind, f.provenance, f.direct, f.reversed,
    f.origin_x, f.origin_y, f.origin_z, f.axis_x_x, f.axis_x_y, f.axis_x_z, f.axis_z_x, f.axis_z_y, f.axis_z_z,
    f.radius, f.radius2, f.semi_angle, f.u0, f.u1, f.v0, f.v1, f.area, f.centroid_x, f.centroid_y, f.centroid_z,
    f.x0, f.y0, f.z0, f.x1, f.y1, f.z1
FROM sought AS s
JOIN surface AS f ON CAST(floor(f.centroid_x / :cell + :shift) AS BIGINT) = s.x
    AND CAST(floor(f.centroid_y / :cell + :shift) AS BIGINT) = s.y
    AND CAST(floor(f.centroid_z / :cell + :shift) AS BIGINT) = s.z
ORDER BY s.no, f.id
