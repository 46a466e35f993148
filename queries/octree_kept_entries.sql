-- The parts copied from the revision before, in the cells of the oct-tree that they were in.
-- Takes world_id, previous (the revision before) and shift (by which the copies' identities are larger).
-- Gives nothing.
INSERT INTO octree_entry (world_id, cell, occurrence_id)
SELECT :world_id, e.cell, o.id
FROM octree_entry AS e
JOIN occurrence AS o ON o.id = e.occurrence_id + :shift AND o.world_id = :world_id
WHERE e.world_id = :previous
ORDER BY e.cell, o.id
