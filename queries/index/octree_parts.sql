-- The parts of an expanded object, with their boxes.
-- Takes object_id; gives body_no, node_no and the box x0 .. z1 in the body's frame, sorted by the first two.
SELECT body_no, node_no, x0, y0, z0, x1, y1, z1
FROM object_node
WHERE object_id = :object_id AND part_id IS NOT NULL
ORDER BY body_no, node_no
