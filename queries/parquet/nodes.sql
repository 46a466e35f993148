-- Parts in the objects that are or were placed in some worlds, in the objects' own frames: of some of their pages.
-- Takes worlds (array of names), first_page and last_page, counted from 0 in the order of parquet/pages; gives
-- object_id, page, node_no, body_no, path from the object down, number and name of the part, part_id, shape_id, the box
-- x0 .. z1 in the body's frame and body_from_node m00 .. m23, sorted by object_id, page and node_no.
WITH counted AS (
    SELECT g.object_id, g.page, row_number() OVER (ORDER BY g.object_id, g.page) - 1 AS place
    FROM object_page AS g
    WHERE g.object_id IN (SELECT object_id FROM placed_object WHERE world = ANY(:worlds))
)
SELECT n.object_id, n.page, n.node_no, n.body_no, n.path, part.number, part.name, n.part_id, n.shape_id,
    n.x0, n.y0, n.z0, n.x1, n.y1, n.z1,
    n.m00, n.m01, n.m02, n.m03, n.m10, n.m11, n.m12, n.m13, n.m20, n.m21, n.m22, n.m23
FROM counted AS c
JOIN object_node AS n ON n.object_id = c.object_id AND n.page = c.page
JOIN part ON part.id = n.part_id
WHERE c.place BETWEEN :first_page AND :last_page
ORDER BY n.object_id, n.page, n.node_no
