-- Arcs that begin in given cells of a grid.
-- Takes the relation sought (no: of what is looked for; x, y, z: its cell), cell (mm) and shift (of the grid, in
-- cells);
-- gives no, id, what an arc's key is made of and its box, in order of no and id.
SELECT s.no, a.id, a.kind, a.recognised_kind, a.provenance,
    a.origin_x, a.origin_y, a.origin_z, a.axis_x_x, a.axis_x_y, a.axis_x_z, a.axis_z_x, a.axis_z_y, a.axis_z_z,
    a.radius, a.radius2, a.t0, a.t1, a.start_x, a.start_y, a.start_z, a.end_x, a.end_y, a.end_z,
    a.x0, a.y0, a.z0, a.x1, a.y1, a.z1
FROM sought AS s
JOIN arc AS a ON CAST(floor(a.start_x / :cell + :shift) AS BIGINT) = s.x
    AND CAST(floor(a.start_y / :cell + :shift) AS BIGINT) = s.y
    AND CAST(floor(a.start_z / :cell + :shift) AS BIGINT) = s.z
ORDER BY s.no, a.id
