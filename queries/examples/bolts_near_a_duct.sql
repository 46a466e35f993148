-- Which bolts stand within 120 mm of the axis of the round duct (x = 618, y = 428 in the body)?
SELECT o.path, sqrt(
    power(b.m00 * (o.m03 - b.m03) + b.m10 * (o.m13 - b.m13) + b.m20 * (o.m23 - b.m23) - 618 /* x */, 2)
    + power(b.m01 * (o.m03 - b.m03) + b.m11 * (o.m13 - b.m13) + b.m21 * (o.m23 - b.m23) - 428 /* y */, 2)) AS distance
FROM current_world AS w
JOIN occurrence AS b ON b.world_id = w.world_id AND b.path = 'bulkhead/BODY'
JOIN occurrence AS o ON o.world_id = w.world_id AND o.kind = 'part'
JOIN part AS p ON p.id = o.part_id AND p.number = 'BOLT_M8' /* number */
WHERE w.name = 'demo_cell' /* world */ AND sqrt(
    power(b.m00 * (o.m03 - b.m03) + b.m10 * (o.m13 - b.m13) + b.m20 * (o.m23 - b.m23) - 618 /* x */, 2)
    + power(b.m01 * (o.m03 - b.m03) + b.m11 * (o.m13 - b.m13) + b.m21 * (o.m23 - b.m23) - 428 /* y */, 2)) < 120 /* distance */
ORDER BY o.path
