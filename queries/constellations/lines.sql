-- The longest straight edges of an object's parts, in its frame; edges of parts that meet along one are given once
-- each. Parts that joints move are left out.
-- Takes object_id, least_length (mm), most; gives start_x .. end_z (mm).
SELECT
    o.m00 * a.start_x + o.m01 * a.start_y + o.m02 * a.start_z + o.m03 AS start_x,
    o.m10 * a.start_x + o.m11 * a.start_y + o.m12 * a.start_z + o.m13 AS start_y,
    o.m20 * a.start_x + o.m21 * a.start_y + o.m22 * a.start_z + o.m23 AS start_z,
    o.m00 * a.end_x + o.m01 * a.end_y + o.m02 * a.end_z + o.m03 AS end_x,
    o.m10 * a.end_x + o.m11 * a.end_y + o.m12 * a.end_z + o.m13 AS end_y,
    o.m20 * a.end_x + o.m21 * a.end_y + o.m22 * a.end_z + o.m23 AS end_z
FROM object_node AS o
JOIN shape_arc AS s ON s.shape_id = o.shape_id AND s.convexity IN ('convex', 'concave', 'free')
JOIN arc AS a ON a.id = s.arc_id AND a.recognised_kind = 'line'
WHERE o.object_id = :object_id AND o.part_id IS NOT NULL AND o.body_no = 0 AND a.length >= :least_length
ORDER BY a.length DESC, o.node_no, s.arc_no
LIMIT :most
