-- Objects that contain themselves, at whatever depth.
-- Takes nothing; gives object_id.
WITH RECURSIVE contains (ancestor, descendant) AS (
    SELECT parent_id, child_id FROM object_object
    UNION  -- not ALL: pairs that were found before end the recursion
    SELECT c.ancestor, o.child_id
    FROM contains AS c
    JOIN object_object AS o ON o.parent_id = c.descendant
)
SELECT ancestor AS object_id FROM contains WHERE ancestor = descendant ORDER BY ancestor
