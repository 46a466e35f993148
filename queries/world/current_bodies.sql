-- Where the objects and links stand in the newest revision of a world.
-- Takes world (its name); gives object_no, body_no, object_variant_id, role, tolerance_mm and world_from_body as m00 ..
-- m23.
SELECT b.object_no, b.body_no, b.object_variant_id, b.role, b.tolerance_mm,
    b.m00, b.m01, b.m02, b.m03, b.m10, b.m11, b.m12, b.m13, b.m20, b.m21, b.m22, b.m23
FROM placed_body AS b
JOIN placed_object AS p ON p.object_no = b.object_no
WHERE p.world = :world AND b.last_revision IS NULL
