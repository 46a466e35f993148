-- The pages of an expanded object, from the boxes of its parts.
-- Takes object_id; gives nothing.
INSERT INTO object_page (object_id, page, body_no, box_count, x0, y0, z0, x1, y1, z1)
SELECT object_id, page, body_no, count(*), min(x0), min(y0), min(z0), max(x1), max(y1), max(z1)
FROM object_node
WHERE object_id = :object_id AND page IS NOT NULL
GROUP BY object_id, page, body_no
ORDER BY page
