-- Whether the expansion of an object is there.
-- Takes object_id; gives one row or none.
SELECT object_id
FROM object_node
WHERE object_id = :object_id
LIMIT 1
