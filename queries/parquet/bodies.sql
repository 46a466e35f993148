-- What is or was placed in some worlds: a row for each object and for each link of the robots in it.
-- Takes worlds (array of names); gives world, object_no, body_no, name, object_id, object and variant (as loaded),
-- role, first_revision and last_revision (null: it holds in the newest), the box x0 .. z1 around its parts in the world
-- and world_from_body m00 .. m23, sorted by object_no, first_revision and body_no.
SELECT p.world, b.object_no, b.body_no, p.name, p.object_id, v.name AS object, v.variant, b.role,
    b.first_revision, CAST(b.last_revision AS DOUBLE PRECISION) AS last_revision, b.x0, b.y0, b.z0, b.x1, b.y1, b.z1,
    b.m00, b.m01, b.m02, b.m03, b.m10, b.m11, b.m12, b.m13, b.m20, b.m21, b.m22, b.m23
FROM placed_object AS p
JOIN placed_body AS b ON b.object_no = p.object_no
JOIN object_variant AS v ON v.id = b.object_variant_id
WHERE p.world = ANY(:worlds)
ORDER BY b.object_no, b.first_revision, b.body_no
