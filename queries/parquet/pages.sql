-- Pages of the parts in the objects that are or were placed in some worlds.
-- Takes worlds (array of names);
-- gives object_id, page, body_no, box_count and the box x0 .. z1 in the body's frame, sorted by object_id and page.
SELECT g.object_id, g.page, g.body_no, g.box_count, g.x0, g.y0, g.z0, g.x1, g.y1, g.z1
FROM object_page AS g
WHERE g.object_id IN (SELECT object_id FROM placed_object WHERE world = ANY(:worlds))
ORDER BY g.object_id, g.page
