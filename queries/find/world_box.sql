-- The box around all bodies of the newest revision of a world.
-- Takes world (its name); gives one row, x0 .. z1, mm, null where it has no part.
SELECT min(b.x0) AS x0, min(b.y0) AS y0, min(b.z0) AS z0, max(b.x1) AS x1, max(b.y1) AS y1, max(b.z1) AS z1
FROM placed_body AS b
JOIN placed_object AS p ON p.object_no = b.object_no
WHERE p.world = :world AND b.last_revision IS NULL
