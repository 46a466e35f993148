-- The loaded variants of the inspected objects of a world, each as it would stand in the place of the one that is
-- there.
-- Takes world_id and run, before which they were loaded; gives object_no, instance (its name in the world), name, variant, revision (the newest, or the one
-- that is there), object_variant_id, object_id, placed (whether it is the one that is there), role, tolerance_mm and
-- world_from_object as m00 .. m23; those that are there first, then by name of the variant.
WITH loaded AS (
    SELECT v.*
    FROM object_variant AS v
    WHERE EXISTS (SELECT 1 FROM load_report AS l WHERE l.object_variant_id = v.id AND l.run_id < :run)
)
SELECT w.object_no, w.name AS instance, v.name, v.variant, v.revision, v.id AS object_variant_id, v.object_id,
    v.id = w.object_variant_id AS placed, w.role, w.tolerance_mm,
    w.m00, w.m01, w.m02, w.m03, w.m10, w.m11, w.m12, w.m13, w.m20, w.m21, w.m22, w.m23
FROM world_object AS w
JOIN object_variant AS there ON there.id = w.object_variant_id
JOIN loaded AS v ON v.name = there.name
WHERE w.world_id = :world_id AND w.role = 'inspected'
    AND (v.id = there.id OR (v.variant <> there.variant AND NOT EXISTS (
        SELECT 1 FROM loaded AS later
        WHERE later.name = v.name AND later.variant = v.variant AND later.revision > v.revision
    )))
ORDER BY w.object_no, placed DESC, v.variant
